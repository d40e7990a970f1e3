"""A turning head in a still room detects no motion: drawn pictures through the whole chain."""

from dataclasses import replace
from math import degrees, radians

import numpy as np
import pytest
from fakes.runs import play
from fakes.scenes import EmptyScene

from gazerig.config.schema import load_rig
from gazerig.robot.loop.loop import Tick
from gazerig.robot.run import surroundings
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.sim_mock.scenes.scene import Thing

pytestmark = pytest.mark.usefixtures("ideal_servos")

SECONDS = 3.0


class Room(EmptyScene):
    """A scene: a room, and optionally a ball that flies through it."""

    def __init__(self, ball: bool) -> None:
        self._ball = ball

    def things(self, t_s: float) -> tuple[Thing, ...]:
        place = (1.5, 0.5 * float(np.sin(2.0 * t_s)), 0.25)
        return (Thing(1, "ball", place, 0.1),) if self._ball else ()


def watched(room: Room, patch: pytest.MonkeyPatch, seconds: float) -> list[Tick]:
    """Run a rig with all of the head in each glance around."""
    patch.setattr(surroundings, "load_scene", lambda name, seed: room)
    rig = load_rig("desk")
    head = replace(rig.gaze.head, eye_only_range_deg=6.0)
    rig = replace(
        rig,
        loop=replace(rig.loop, rate_hz=100.0),
        gaze=replace(rig.gaze, head=head),
        detector=replace(rig.detector, work_width_px=128),
    )
    made = Run(rig, RunOptions(mock=True, fast=True, seed=1, scene=room.name, pixels=True))
    ticks: list[Tick] = []
    play(made, seconds, ticks.append)
    return ticks


def test_nothing_in_a_still_room_becomes_a_target(monkeypatch):
    ticks = watched(Room(ball=False), monkeypatch, SECONDS)
    yaws = np.array([tick.pose.head_rad[0] for tick in ticks])
    rates = np.array([tick.pose.head_rate_rad_s[0] for tick in ticks])
    assert np.ptp(yaws) > radians(15.0), f"the head turned {degrees(np.ptp(yaws)):.1f} deg only"
    assert np.abs(rates).max() > radians(25.0)
    assert ticks[-1].percept is not None  # pictures came through
    assert {tick.target.kind for tick in ticks} <= {"rest", "glance", "search"}


def test_what_moves_in_the_same_room_does(monkeypatch):
    """So the silence before is not that of a detector that finds nothing."""
    ticks = watched(Room(ball=True), monkeypatch, 1.5)
    assert "thing" in {tick.target.kind for tick in ticks}

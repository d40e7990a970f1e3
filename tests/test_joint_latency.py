"""Latency of joints: measured from their motion, and the lead of tracks with sound."""

from math import radians

import numpy as np
import pytest

import gazerig
from gazerig.config.schema import load_rig
from gazerig.gaze.track.track import KeyFrame, Track
from gazerig.gaze.track.track_player import TrackPlayer
from gazerig.robot.loop.joint_latency import JointLatency
from gazerig.robot.loop.track_choices import TrackChoices
from gazerig.robot.model.commands import Play
from gazerig.robot.model.types import JointState, further_joints
from gazerig.robot.run.rig_limits import lid_spans, limits

PERIOD_S, DEFAULT_S = 0.005, 0.02


def measured(
    delays_s: list[float],
    sizes_deg: list[float],
    seconds: float,
    buses: tuple[str, ...],
    **how: bool,
) -> tuple[float, ...]:
    """Return the latencies of joints that swing and follow with delays, off by a constant error."""
    latency, random = JointLatency(buses), np.random.default_rng(1)
    phases = random.uniform(0.0, 6.0, len(buses))
    delays, sizes = np.array(delays_s), np.radians(sizes_deg)
    on, seen = (how.get("torque", True),) * len(buses), (how.get("seen", True),) * len(buses)
    for k in range(round(seconds / PERIOD_S)):
        t_s = k * PERIOD_S
        read_s = t_s + 0.002
        places = sizes * np.sin(2.0 * np.pi * 1.5 * (read_s - delays) + phases) + radians(0.8)
        command = sizes * np.sin(2.0 * np.pi * 1.5 * t_s + phases)
        row = tuple(places.tolist())
        latency.add(
            t_s,
            tuple(command.tolist()),
            JointState(row, row, (read_s,) * len(row), (), torque=on, measured=seen),
        )
    return latency.estimates_s(DEFAULT_S)


def test_each_joint_has_its_own_latency_or_that_of_its_bus_or_the_default() -> None:
    buses = ("a", "a", "a", "b")
    found = measured([0.012, 0.03, 0.0, 0.05], [10.0, 10.0, 0.0, 0.0], 3.0, buses)
    assert found[:2] == pytest.approx((0.012, 0.03), abs=0.0011)
    assert found[2] == pytest.approx(0.021, abs=0.002)  # at rest: the mean of its bus
    assert found[3] == DEFAULT_S
    assert measured([0.012], [10.0], 0.1, ("a",)) == (DEFAULT_S,)
    assert measured([0.012], [10.0], 3.0, ("a",), torque=False) == (DEFAULT_S,)
    assert measured([0.012], [10.0], 3.0, ("a",), seen=False) == (DEFAULT_S,)
    assert max(measured([0.5], [10.0], 3.0, ("a",))) <= 0.2


def test_joints_of_slower_buses_begin_earlier() -> None:
    rig = load_rig("expressive")
    sound = Track(
        "both",
        (
            KeyFrame(1.0, head_yaw_deg=10.0, joints_deg={"jaw": 5.0}),
            KeyFrame(2.0, head_yaw_deg=-5.0),
        ),
        sound="it.wav",
    )
    player = TrackPlayer(len(further_joints(rig.joints)))
    choices = TrackChoices({"it": sound}, player, rig.names, lid_spans(rig))
    lead_s = [0.01] * len(rig.names)
    lead_s[rig.names.index("jaw")] = 0.05
    bounds, rest = limits(rig.joints), (0.0,) * len(rig.names)
    assert choices.play(Play("it", lead_s=tuple(lead_s)), 0.0, rest, bounds).track is not None
    jaw = 9 + further_joints(rig.joints).index("jaw")
    (voice,) = player.voices
    plain = choices.prepare(Play("it"), bounds).motion  # the track as written
    for t_s in (0.3, 0.9, 1.4):
        for channel, early_s in ((0, 0.01), (jaw, 0.05)):
            then = plain.sample_at(np.array([t_s - 0.05 + early_s]))[0, 0, channel]
            assert voice.state(t_s)[0, channel] == pytest.approx(then, abs=1e-9)
    (state,) = choices.states(0.3)
    assert state.position_s == pytest.approx(0.25)  # the sound begins when the jaw moves


def test_a_running_head_measures_the_latency_of_its_servos() -> None:
    with gazerig.open("expressive", fast=True) as head:
        assert head._made is not None
        robot = head._made.robot
        assert set(robot.joint_latencies_s()) == {0.015}  # the parameter
        head.step(4.0)
        found = robot.joint_latencies_s()
    assert all(0.008 <= one <= 0.025 for one in found) and set(found) != {0.015}

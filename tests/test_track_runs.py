"""Tracks on whole robots over emulated servos in simulated time: followed, within every limit."""

from dataclasses import replace
from math import degrees

import numpy as np
import pytest
from fakes.runs import ticks

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_limits import limits
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import LookAt, Play
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.reply import CommandReply

pytestmark = pytest.mark.usefixtures("ideal_servos")

DT = 0.005
POINT = (1.0, 0.0, 0.25)


def steady(name: str) -> Rig:
    """Return a rig without breath, sway, recentring, and eye turns of blinks."""
    rig = load_rig(name)
    gaze = rig.gaze
    gaze = replace(
        gaze,
        breathing=replace(gaze.breathing, pitch_deg=0.0, roll_deg=0.0),
        sway=replace(gaze.sway, yaw_deg=0.0, pitch_deg=0.0, roll_deg=0.0),
        head=replace(gaze.head, recentre_after_ms=60_000.0),
        lids=replace(gaze.lids, eye_down_deg=0.0, eye_nasal_deg=0.0),
    )
    return replace(rig, gaze=gaze)


def played(made: Assembly, track: str) -> tuple[CommandReply, list[Tick]]:
    """Play a track and go on until shortly after its end."""
    ticket = made.robot.command(Play(track))
    first = ticks(made, 1)
    reply = ticket.wait(0.0)
    assert reply is not None and reply.track is not None, reply
    return reply, first + ticks(made, int(reply.track.duration_s / DT) + 60)


@pytest.mark.parametrize("name", ("desk", "expressive", "feetech", "maker"))
def test_joints_follow_tracks_within_limits_and_the_eyes_stay_on_the_point(name: str) -> None:
    rig = steady(name)
    made = assemble(rig, RunOptions(mock=True, fast=True, scene="visitor"))
    bounds = limits(rig.joints)
    lids = np.array([joint.endswith("lid") for joint in rig.names])
    try:
        made.robot.start(made.clock)
        made.robot.command(LookAt(POINT, "test", stay=True))
        before = ticks(made, 500)[-1]
        for track in ("nod", "shake", "laugh", "look_around"):
            _, done = played(made, track)
            desired = np.array([tick.desired_rad for tick in done])
            commanded = np.array([tick.guard_result.command_rad for tick in done])
            measured = np.array([tick.joints.position_rad for tick in done])
            for j, limit in enumerate(bounds):
                one = commanded[:, j]
                assert limit.low_rad - 1e-9 <= one.min() and one.max() <= limit.high_rad + 1e-9
                assert np.abs(np.diff(one)).max() / DT <= limit.speed_rad_s * (1.0 + 1e-6)
                assert np.abs(np.diff(one, 2)).max() / DT**2 <= limit.accel_rad_s2 * (1.0 + 1e-6)
            # A blink may come in between and ask for more than a lid can do; nothing else may.
            assert np.array_equal(desired[:, ~lids], commanded[:, ~lids])
            moved = np.ptp(commanded[:, ~lids], axis=0)
            if track != "laugh" or "neck_pitch" in rig.names:
                assert degrees(moved.max()) > 4.0
            behind = np.abs(commanded - measured)[:, ~lids].max(axis=0)
            assert degrees(behind.max()) < 7.0 and (behind < 0.75 * moved + 0.02).all()
            assert np.abs(desired[-1] - before.desired_rad)[~lids].max() < np.radians(0.1)
            if track in ("nod", "shake", "laugh") and "neck_pitch" in rig.names:
                errors = [
                    gaze_error(POINT, tick.pose, "eyes_pan" not in rig.names) for tick in done
                ]
                assert max(degrees(error.whole) for error in errors) < 1.0
    finally:
        made.close()


def test_eyes_that_did_not_compensate_would_be_found() -> None:
    """The nod moves the head by more than the eyes may be off."""
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, scene="visitor"))
    try:
        made.robot.start(made.clock)
        made.robot.command(LookAt(POINT, "test", stay=True))
        ticks(made, 500)
        _, done = played(made, "nod")
        pitch = [tick.pose.head_rad[1] for tick in done]
        assert degrees(max(pitch) - min(pitch)) > 7.0
    finally:
        made.close()

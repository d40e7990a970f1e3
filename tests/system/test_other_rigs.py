"""The maker's eyes and a rig of three kinds of bus, alive in simulated time."""

from math import radians

import numpy as np
import pytest
from fakes.runs import go, simulated
from mixed_rig import rig_of
from slow_rigs import slowed

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.loop.tick import Tick
from gazerig.robot.run.run import Run

Ran = tuple[Run, list[Tick], tuple[str, ...]]


def ran(rig: Rig, seconds: float) -> Ran:
    """Run a rig before a visitor; return the run, every tick, and the messages at the start."""
    made = simulated(slowed(rig, 100.0))
    ticks: list[Tick] = []
    made.robot.start(made.clock)
    said = made.robot.body.bus.events()
    assert go(made, seconds, ticks.append).stopped_by == "over"
    return made, ticks, said


def test_a_rig_of_three_kinds_of_bus_looks_at_its_visitor_blinks_and_lets_go(tmp_path):
    _looks_blinks_and_lets_go(*ran(rig_of("mixed", tmp_path), 8.0)[:2])


def _looks_blinks_and_lets_go(made: Run, ticks: list[Tick]) -> None:
    rig, robot = made.rig, made.robot
    last = ticks[-1]
    assert all(len(t.desired_rad) == len(rig.names) == len(t.joints.position_rad) for t in ticks)
    assert last.gaze.saccades > 10 and last.gaze.blinks >= 1
    assert {t.target.kind for t in ticks[200:]} >= {"face"}
    # Both eyes' mean line of sight is on the point that is looked at.
    on = [t for t in ticks[300:] if t.target.kind == "face" and t.gaze.phase == "fixate"]
    eyes = np.array([(t.pose.eye_left_rad, t.pose.eye_right_rad) for t in on]).mean(axis=1)
    desired = np.array([(t.gaze.eye_left_rad, t.gaze.eye_right_rad) for t in on]).mean(axis=1)
    assert np.degrees(np.median(np.abs(eyes - desired))) < 0.6
    assert robot.park(made.park_rad, made.clock, made.loop)
    robot.stop()
    made.close()


def test_the_makers_eyes_have_no_neck_to_move_and_four_lids_that_meet():
    made, ticks, said = ran(load_rig("maker"), 12.0)
    _looks_blinks_and_lets_go(made, ticks)
    assert any("no positions" in line for line in said)
    for tick in ticks:
        assert tick.pose.head_rad == (0.0, 0.0, 0.0)
        assert tick.pose.eye_left_rad == tick.pose.eye_right_rad
        assert tick.joints.measured == (False,) * 6
        assert tick.joints.temperature_c == (None,) * 6
        assert not any("not moving" in reason for reason in tick.guard_result.reasons)
    rig = made.rig
    i = {name: k for k, name in enumerate(rig.names)}
    desired = np.degrees([t.guard_result.command_rad for t in ticks])
    shut = np.flatnonzero([t.gaze.lid_left == 0.0 for t in ticks])
    assert len(shut) > 3  # some blink shuts fully
    at = shut[len(shut) // 2]
    ends_deg = rig.lid_joints.ends_deg("left_upper_lid")
    assert ends_deg is not None
    assert ticks[at].desired_rad[i["left_upper_lid"]] == pytest.approx(radians(ends_deg[0]))
    assert ticks[at].gaze.lower_left == 0.0
    # Between blinks the lids follow the eyes: upper and lower in the same direction.
    open_ = [k for k, t in enumerate(ticks) if not t.gaze.blink and k > 300]
    tilt = desired[open_, i["eyes_tilt"]]
    upper, lower = desired[open_, i["left_upper_lid"]], desired[open_, i["left_lower_lid"]]
    assert np.ptp(tilt) > 2.0
    assert np.corrcoef(tilt, upper)[0, 1] > 0.6  # looks up: the upper lid opens
    assert np.corrcoef(tilt, lower)[0, 1] < -0.6  # and the lower one follows it up: less open

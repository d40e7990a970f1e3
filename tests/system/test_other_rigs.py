"""The maker's eyes, alive in simulated time."""

from math import radians

import numpy as np
import pytest
from fakes.runs import go, simulated
from slow_rigs import slowed

from gazerig.config.schema import load_rig
from gazerig.robot.loop.tick import Tick


def test_the_makers_eyes_have_no_neck_to_move_and_four_lids_that_meet():
    rig = slowed(load_rig("maker"), 100.0)
    made, ticks = simulated(rig), list[Tick]()
    made.robot.start(made.clock)
    said = made.robot.body.bus.events()
    assert go(made, 12.0, ticks.append).stopped_by == "over"
    assert made.robot.park(made.park_rad, made.clock, made.loop)
    made.robot.stop()
    made.close()
    last = ticks[-1]
    assert len(last.desired_rad) == len(rig.names) == len(last.joints.position_rad)
    assert last.gaze.saccades > 10 and last.gaze.blinks >= 1
    # Both eyes' mean line of sight is on the point that is looked at.
    on = [t for t in ticks[300:] if t.target.kind == "face" and t.gaze.phase == "fixate"]
    eyes = np.array([(t.pose.eye_left_rad, t.pose.eye_right_rad) for t in on]).mean(axis=1)
    desired = np.array([(t.gaze.eye_left_rad, t.gaze.eye_right_rad) for t in on]).mean(axis=1)
    assert np.degrees(np.median(np.abs(eyes - desired))) < 0.6
    assert any("no positions" in line for line in said)
    for tick in ticks:
        assert tick.pose.head_rad == (0.0, 0.0, 0.0)
        assert tick.pose.eye_left_rad == tick.pose.eye_right_rad
        assert tick.joints.measured == (False,) * 6
        assert tick.joints.temperature_c == (None,) * 6
        assert not any("not moving" in reason for reason in tick.guard_result.reasons)
    shut = np.flatnonzero([t.gaze.lid_left == 0.0 for t in ticks])
    assert len(shut) > 3  # some blink shuts fully
    at = shut[len(shut) // 2]
    ends_deg = rig.lid_joints.ends_deg("left_upper_lid")
    assert ends_deg is not None
    assert ticks[at].desired_rad[rig.names.index("left_upper_lid")] == pytest.approx(
        radians(ends_deg[0])
    )
    assert ticks[at].gaze.lower_left == 0.0

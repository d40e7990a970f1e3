"""Joints of any name: a jaw, brows, ears."""

from collections.abc import Callable
from dataclasses import replace

from expressive_rig import faults

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.model.types import further_joints, order_joints


def with_joint(name: str) -> Rig:
    """Return the desk rig with one more joint, on a servo of its own."""
    rig = load_rig("desk")
    jaw = replace(rig.joints["left_upper_lid"], id=42, min_deg=-2.0, max_deg=25.0)
    return replace(rig, joints={name: jaw, **rig.joints})


def test_joints_of_gaze_come_first_and_others_follow_by_name() -> None:
    rig = with_joint("jaw")
    names = order_joints({*rig.joints, "brow"})
    assert names[-2:] == ("brow", "jaw") and set(names[:-2]) == set(load_rig("desk").joints)
    assert further_joints(names) == ("brow", "jaw")
    assert order_joints(reversed(names)) == names


def test_a_jaw_is_a_joint_and_a_misspelt_neck_is_not() -> None:
    assert faults(with_joint("jaw")) == []
    rig = with_joint("nek_yaw")
    without = replace(rig, joints={k: v for k, v in rig.joints.items() if k != "neck_yaw"})
    assert any("joints.nek_yaw: did you mean neck_yaw" in fault for fault in faults(without))
    assert any(
        "joints.Jaw!: not a valid joint name" in fault for fault in faults(with_joint("Jaw!"))
    )


def test_a_jaw_is_read_held_at_rest_and_written(started: Callable[[Rig], Assembly]) -> None:
    made = started(with_joint("jaw"))
    tick = made.robot.tick(0.005, 0.005)
    assert made.robot.body.names[-1] == "jaw"
    assert tick.desired_rad[-1] == 0.0
    assert len(tick.guard_result.command_rad) == len(tick.desired_rad) == 10

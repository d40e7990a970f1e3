"""Several buses and coupled servos in one world."""

from dataclasses import replace
from math import degrees, radians
from pathlib import Path

import pytest
from mixed_rig import mixed_rig
from test_coupling import COUPLING
from world_rigs import WorldBench, arm, read, write

from gazerig.config.schema import load_rig
from gazerig.robot.app.run_bus import JOINT_PLAY_DEG

pytestmark = pytest.mark.usefixtures("mujoco")


def test_buses_of_three_kinds_share_one_world(tmp_path: Path) -> None:
    """A Maestro's eyes, a Dynamixel and a Feetech servo in the neck: each moves its own joint."""
    bench = WorldBench(mixed_rig(tmp_path))
    eyes, yaw, pitch = "eyes_pan", bench.servos["neck_yaw"], bench.servos["neck_pitch"]
    arm(yaw)
    arm(pitch)
    write(yaw, "goal_position", read(yaw, "present_position") + 200)
    write(pitch, "goal_position", round(pitch.position_steps) + 100)
    joint = bench.rig.joints[eyes]
    bench.devices[""].channels[joint.id].set_target(round(joint.steps(radians(12.0))))
    before = bench.world.joints_rad()
    bench.pass_ms(900)
    angles = bench.world.joints_rad()
    assert degrees(angles[eyes]) == pytest.approx(12.0, abs=1.2)
    for name, servo in (("neck_yaw", yaw), ("neck_pitch", pitch)):
        assert abs(angles[name] - before[name]) > radians(7.0)
        told = bench.rig.joints[name].angle_rad(servo.position_steps)
        assert told == pytest.approx(angles[name], abs=radians(0.5 * JOINT_PLAY_DEG) + 1e-6)


def test_two_servos_move_two_joints_together() -> None:
    """Both give what their gears make of the joints' angles, and hold them there."""
    rig = replace(load_rig("desk"), couplings={"neck": COUPLING})
    bench = WorldBench(rig)
    pair = [bench.servos[name] for name in ("neck_pitch", "neck_roll")]
    joints = [rig.joints[name] for name in ("neck_pitch", "neck_roll")]
    for servo in pair:
        arm(servo)
    bench.pass_ms(150)
    for servo, joint, angle in zip(pair, joints, COUPLING.servo_rad((0.2, -0.15)), strict=True):
        write(servo, "goal_position", round(joint.steps(angle)))
    for ms in (20, 20, 40, 900):
        bench.pass_ms(ms)
        angles = bench.world.joints_rad()
        truly = COUPLING.servo_rad((angles["neck_pitch"], angles["neck_roll"]))
        for servo, joint, angle in zip(pair, joints, truly, strict=True):
            ahead = servo.shaft.x - servo.shaft.joint
            assert servo.position_steps - ahead == pytest.approx(joint.steps(angle), abs=0.05)
            assert abs(ahead) < 4.0  # play of both joints
    assert angles["neck_pitch"] == pytest.approx(0.2, abs=radians(1.0))
    assert angles["neck_roll"] == pytest.approx(-0.15, abs=radians(1.0))

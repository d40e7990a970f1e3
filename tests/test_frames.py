"""Pose history, camera mounts and the joints' conversion to servo steps."""

from math import radians

import pytest

from gaze.angles import rotate
from robot.body import JointParams
from robot.frames import CameraMount, CameraParams, PoseHistory, standing_still
from robot.kinematics import GeometryParams, Kinematics

KINEMATICS = Kinematics(GeometryParams(60.0, 40.0, 50.0), (-0.4, -0.4), (0.4, 0.4))


def test_poses_are_interpolated_at_the_instant_asked_for() -> None:
    poses = PoseHistory(KINEMATICS)
    with pytest.raises(LookupError):
        poses.head_pose(0.0)
    for k in range(100):
        poses.remember(k * 0.005, (0.01 * k, 0.0, 0.0))
    assert poses.head_pose(0.2525)[1] == pytest.approx(KINEMATICS.head_pose((0.505, 0, 0))[1])
    assert poses.head_pose(-1.0) == KINEMATICS.head_pose((0.0, 0.0, 0.0))
    assert poses.head_pose(9.0) == KINEMATICS.head_pose((0.99, 0.0, 0.0))


def test_old_poses_are_forgotten() -> None:
    poses = PoseHistory(KINEMATICS, ticks=10)
    for k in range(50):
        poses.remember(float(k), (0.01 * k, 0.0, 0.0))
    assert poses.head_pose(0.0) == KINEMATICS.head_pose((0.4, 0.0, 0.0))


def test_camera_axes_are_optical_and_turn_with_the_head() -> None:
    mount = CameraMount(CameraParams("head", (20.0, 0.0, 45.0)))
    R, p = mount.pose(*KINEMATICS.head_pose((radians(90.0), 0.0, 0.0)))
    assert rotate(R, (0.0, 0.0, 1.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    assert rotate(R, (0.0, 1.0, 0.0)) == pytest.approx((0.0, 0.0, -1.0), abs=1e-12)
    assert p == pytest.approx((0.0, 0.060, 0.155))
    base = CameraMount(CameraParams("base", (0.0, 100.0, 300.0), yaw_deg=-90.0))
    R, p = base.pose(*KINEMATICS.head_pose((1.0, 0.2, 0.1)))
    assert p == (0.0, 0.1, 0.3)
    assert rotate(R, (0.0, 0.0, 1.0)) == pytest.approx((0.0, -1.0, 0.0), abs=1e-12)


def test_a_film_sees_from_where_the_head_camera_rests() -> None:
    still = standing_still(CameraParams("head", (20.0, 0.0, 45.0)), KINEMATICS)
    assert still.mount == "base"
    resting = CameraMount(CameraParams("head", (20.0, 0.0, 45.0)))
    expected = resting.pose(*KINEMATICS.head_pose((0.0, 0.0, 0.0)))
    assert CameraMount(still).pose(*KINEMATICS.head_pose((1.0, 0.0, 0.0)))[1] == pytest.approx(
        expected[1]
    )
    assert standing_still(still, KINEMATICS) is still


def test_joint_steps_and_angles_turn_back() -> None:
    joint = JointParams(
        4, "xl330-m077", -30.0, 25.0, 600.0, 1e4, sign=-1, ratio=1.5, zero_step=2100
    )
    for angle in (-0.5, 0.0, 0.3):
        assert joint.angle_rad(joint.steps(angle)) == pytest.approx(angle)
    assert joint.steps(radians(10.0)) == pytest.approx(2100 - 1.5 * 10.0 * 4096 / 360)
    setup = joint.setup()
    assert joint.angle_rad(setup.min_steps) <= radians(25.0) + 1e-12
    assert joint.angle_rad(setup.max_steps) >= radians(-30.0) - 1e-12
    assert setup.max_speed_steps_s == pytest.approx(600.0 * 1.5 * 4096 / 360)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"min_deg": 30.0}, "must be below"),
        ({"min_deg": 5.0}, "0 deg, the centre"),
        ({"zero_step": 100}, "outside the servo's 0..4095"),
    ],
)
def test_joint_limits_that_contradict_each_other_are_refused(
    change: dict[str, float], message: str
) -> None:
    good = {"min_deg": -30.0, "max_deg": 25.0, "max_speed_deg_s": 600.0, "max_accel_deg_s2": 1e4}
    with pytest.raises(ValueError, match=message):
        JointParams(4, "xl330-m077", **{**good, **change})  # type: ignore[arg-type]

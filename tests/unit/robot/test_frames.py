"""A camera's pose is read back from its mount, and limits of a joint contradict each other."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    camera_at_pose,
)
from gazerig.robot.model.joint import JointParams


@given(
    angles=st.tuples(st.floats(-170, 170), st.floats(-85, 85), st.floats(-170, 170)),
    place=st.tuples(*[st.floats(-300.0, 300.0)] * 3),
)
def test_a_camera_is_mounted_where_its_pose_says(
    angles: tuple[float, float, float], place: tuple[float, float, float]
):
    yaw, pitch, roll = angles
    true = CameraParams("base", place, yaw, pitch, 60.0, roll)
    found = camera_at_pose(
        CameraParams("base", horizontal_field_deg=60.0),
        *CameraMount(true).pose(
            ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0)
        ),
    )
    assert found.position_mm == pytest.approx(place, abs=1e-6)
    assert (found.yaw_deg, found.pitch_deg, found.roll_deg) == pytest.approx(angles, abs=1e-6)


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
):
    good = {"min_deg": -30.0, "max_deg": 25.0, "max_speed_deg_s": 600.0, "max_accel_deg_s2": 1e4}
    with pytest.raises(ValueError, match=message):
        JointParams(4, "xl330-m077", **{**good, **change})  # type: ignore[arg-type]

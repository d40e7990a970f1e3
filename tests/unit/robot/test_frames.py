"""A camera's pose is read back from its mount, and limits of a joint contradict each other."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import load_rig
from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    LensParams,
    camera_at_pose,
)
from gazerig.robot.model.joint import JointParams


@given(
    angles=st.tuples(st.floats(-170, 170), st.floats(-85, 85), st.floats(-170, 170)),
    place=st.tuples(*[st.floats(-300.0, 300.0)] * 3),
)
def test_a_camera_is_mounted_where_its_pose_says(angles, place):
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


_LENS = """
camera:
  roll_deg: 1.5
  lens: {size_px: [640, 400], focal_px: [478.5, 480.0], centre_px: [327.0, 189.5],
    distortion: [-0.11, 0.06, 0.0, 0.0, 0.0]}
"""


def _rig_with(tmp_path: Path, camera: str) -> str:
    """Write the desk rig with another camera section."""
    shipped = Path(__file__).parents[3] / "config" / "rigs" / "desk.yaml"
    before, _, after = shipped.read_text().partition("\ncamera:")
    rest = after[after.index("\nloop:") :]
    rig = tmp_path / "rig.yaml"
    rig.write_text(f"{before}{camera}{rest}")
    return str(rig)


def test_a_measured_lens_is_read_from_the_rig_file(tmp_path):
    camera = load_rig(_rig_with(tmp_path, _LENS)).camera
    assert camera.roll_deg == 1.5
    assert camera.lens == LensParams(
        (640, 400), (478.5, 480.0), (327.0, 189.5), (-0.11, 0.06, 0.0, 0.0, 0.0)
    )
    assert load_rig("desk").camera.lens is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"min_deg": 30.0}, "must be below"),
        ({"min_deg": 5.0}, "0 deg, the centre"),
        ({"zero_step": 100}, "outside the servo's 0..4095"),
    ],
)
def test_joint_limits_that_contradict_each_other_are_refused(change, message):
    good = {"min_deg": -30.0, "max_deg": 25.0, "max_speed_deg_s": 600.0, "max_accel_deg_s2": 1e4}
    with pytest.raises(ValueError, match=message):
        JointParams(4, "xl330-m077", **{**good, **change})

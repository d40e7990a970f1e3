"""Pose history, camera mounts and the joints' conversion to servo steps."""

from math import cos, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from gaze_targets import joints_at
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between, angles_of, norm, rotate, rotate_back, rotation, sub
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import GazeCommand
from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    LensParams,
    PoseHistory,
    camera_at_pose,
    fixed_mount,
)
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

KINEMATICS = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)


def test_poses_are_interpolated_at_the_instant_asked_for():
    poses = PoseHistory(KINEMATICS)
    with pytest.raises(LookupError):
        poses.head_pose(0.0)
    for k in range(100):
        poses.remember(k * 0.005, (0.01 * k, 0.0, 0.0))
    assert poses.head_pose(0.2525)[1] == pytest.approx(KINEMATICS.head_pose((0.505, 0, 0))[1])
    assert poses.head_pose(-1.0) == KINEMATICS.head_pose((0.0, 0.0, 0.0))
    assert poses.head_pose(9.0) == KINEMATICS.head_pose((0.99, 0.0, 0.0))


def test_camera_axes_are_optical_and_turn_with_the_head():
    mount = CameraMount(CameraParams("head", (20.0, 0.0, 45.0)))
    R, p = mount.pose(*KINEMATICS.head_pose((radians(90.0), 0.0, 0.0)))
    assert rotate(R, (0.0, 0.0, 1.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    assert rotate(R, (0.0, 1.0, 0.0)) == pytest.approx((0.0, 0.0, -1.0), abs=1e-12)
    assert p == pytest.approx((0.0, 0.060, 0.155))
    base = CameraMount(CameraParams("base", (0.0, 100.0, 300.0), yaw_deg=-90.0))
    R, p = base.pose(*KINEMATICS.head_pose((1.0, 0.2, 0.1)))
    assert p == (0.0, 0.1, 0.3)
    assert rotate(R, (0.0, 0.0, 1.0)) == pytest.approx((0.0, -1.0, 0.0), abs=1e-12)


def test_a_rolled_camera_has_its_right_side_down():
    R, _ = CameraMount(CameraParams("base", (0.0, 0.0, 0.0), roll_deg=90.0)).pose(
        *KINEMATICS.head_pose((0.0, 0.0, 0.0))
    )
    assert rotate(R, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, -1.0), abs=1e-12)
    assert rotate(R, (0.0, 0.0, 1.0)) == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


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


def test_a_measured_lens_is_read_from_the_rig_file(tmp_path: Path):
    camera = load_rig(_rig_with(tmp_path, _LENS)).camera
    assert camera.roll_deg == 1.5
    assert camera.lens == LensParams(
        (640, 400), (478.5, 480.0), (327.0, 189.5), (-0.11, 0.06, 0.0, 0.0, 0.0)
    )
    assert load_rig("desk").camera.lens is None


def test_a_film_sees_from_where_the_head_camera_rests():
    still = fixed_mount(CameraParams("head", (20.0, 0.0, 45.0)), KINEMATICS)
    assert still.mount == "base"
    resting = CameraMount(CameraParams("head", (20.0, 0.0, 45.0)))
    expected = resting.pose(*KINEMATICS.head_pose((0.0, 0.0, 0.0)))
    assert CameraMount(still).pose(*KINEMATICS.head_pose((1.0, 0.0, 0.0)))[1] == pytest.approx(
        expected[1]
    )
    assert fixed_mount(still, KINEMATICS) is still
    rolled = CameraParams(roll_deg=3.0, lens=LensParams((640, 400), (480.0, 480.0), (320.0, 200.0)))
    kept = fixed_mount(rolled, KINEMATICS)
    assert (kept.roll_deg, kept.lens) == (3.0, rolled.lens)


def test_joint_steps_and_angles_turn_back():
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
):
    good = {"min_deg": -30.0, "max_deg": 25.0, "max_speed_deg_s": 600.0, "max_accel_deg_s2": 1e4}
    with pytest.raises(ValueError, match=message):
        JointParams(4, "xl330-m077", **{**good, **change})  # type: ignore[arg-type]


# ---- Kinematics: forward and inverse against each other over the whole range.


GEOMETRY = GeometryParams(62.0, 38.0, 51.0)
WIDE = Kinematics(
    GEOMETRY,
    GAZE_JOINTS,
    {
        "left_upper_lid": (radians(-25), radians(20)),
        "right_upper_lid": (radians(25), radians(-20)),
    },
)
degree = st.floats(-1.0, 1.0)


@given(
    head=st.tuples(degree, degree, degree),
    point=st.tuples(st.floats(0.3, 5.0), st.floats(-2.0, 2.0), st.floats(-1.0, 1.5)),
)
def test_eyes_on_a_point_and_the_lines_of_sight_meet_in_it(
    head: tuple[float, float, float], point: tuple[float, float, float]
):
    angles = (head[0] * 1.2, head[1] * 0.6, head[2] * 0.5)
    R, p = WIDE.head_pose(angles)
    left, right = WIDE.eye_angles_to(point, R, p)
    state = WIDE.forward(joints_at((*left, *right, 0.0, 0.0, *angles)))
    for is_left in (True, False):
        eye = state.p_world_eye_left_m if is_left else state.p_world_eye_right_m
        assert angle_between(line_of_sight(state, is_left), sub(point, eye)) < 1e-9


@given(
    q=st.tuples(*[st.floats(-0.6, 0.6)] * 4),
    lids=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
    head=st.tuples(st.floats(-1.5, 1.5), st.floats(-0.7, 0.7), st.floats(-0.5, 0.5)),
)
def test_forward_of_inverse_is_the_identity(
    q: tuple[float, ...], lids: tuple[float, float], head: tuple[float, float, float]
):
    command = GazeCommand(
        head, (q[0], q[1]), (q[2], q[3]), *lids, "fixate", False, (1.0, 0.0, 0.0), 0, 0, 0
    )
    state = WIDE.forward(joints_at(WIDE.inverse(command)))
    assert state.head_rad == head
    assert (*state.eye_left_rad, *state.eye_right_rad) == q
    assert (state.lid_left, state.lid_right) == pytest.approx(lids, abs=1e-9)


@given(st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)))
def test_rotations_turn_back(angles: tuple[float, float, float]):
    R = rotation(angles)
    assert angles_of(R) == pytest.approx(angles, abs=1e-9)
    v = (0.3, -1.2, 0.7)
    assert rotate_back(R, rotate(R, v)) == pytest.approx(v, abs=1e-12)
    assert np.linalg.det(np.array(R)) == pytest.approx(1.0)


def test_signs_are_left_up_and_right_ear_down():
    R, _ = WIDE.head_pose((radians(10), 0.0, 0.0))
    assert rotate(R, (1.0, 0.0, 0.0))[1] > 0.0
    R, _ = WIDE.head_pose((0.0, radians(10), 0.0))
    assert rotate(R, (1.0, 0.0, 0.0))[2] > 0.0
    R, _ = WIDE.head_pose((0.0, 0.0, radians(10)))
    assert rotate(R, (0.0, -1.0, 0.0))[2] < 0.0


def test_eyes_are_where_the_geometry_says():
    state = WIDE.forward(joints_at([0.0] * 9))
    assert state.p_world_head_m == pytest.approx((0.038, 0.0, 0.113))
    gap = sub(state.p_world_eye_left_m, state.p_world_eye_right_m)
    assert norm(gap) == pytest.approx(0.0619)
    assert gap[1] > 0.0


ONE_PAN = Kinematics(GEOMETRY, ("eyes_pan", "eyes_tilt"), {})


@given(angle=st.floats(-3.14, 3.14), far=st.floats(0.3, 5.0))
def test_eyes_on_one_linkage_point_between_what_each_would_need(angle: float, far: float):
    R, p = ONE_PAN.head_pose((0.0, 0.0, 0.0))
    point = (p[0] + far * cos(angle), far * sin(angle), p[2])
    left, right = ONE_PAN.eye_angles_to(point, R, p)
    assert left == right
    off = abs(left[0] - angle)
    # Next to the head one eye is nearer, so the mean is not quite that of the middle.
    assert min(off, 2.0 * pi - off) < 0.01 / far


def test_eyes_on_one_linkage_turn_to_the_end_for_a_point_straight_behind():
    R, p = ONE_PAN.head_pose((0.0, 0.0, 0.0))
    for aside in (-0.05, -0.001, 0.0, 0.001, 0.05):
        (pan, _), _ = ONE_PAN.eye_angles_to((p[0] - 1.0, aside, p[2]), R, p)
        assert abs(pan) > 3.0
        assert pan * aside >= 0.0


@given(
    point=st.tuples(st.floats(0.3, 5.0), st.floats(-2.0, 2.0), st.floats(-1.0, 1.5)),
)
def test_a_neck_that_faces_a_point_leads_the_head_through_it(
    point: tuple[float, float, float],
):
    yaw, pitch = WIDE.neck_angles_to(point)
    R, p = WIDE.head_pose((yaw, pitch, 0.0))
    assert angle_between(rotate(R, (1.0, 0.0, 0.0)), sub(point, p)) < 1e-9

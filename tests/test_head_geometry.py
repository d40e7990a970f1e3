"""Kinematics: forward and inverse against each other over the whole range."""

from math import cos, pi, radians, sin

import numpy as np
import pytest
from desk import GAZE_JOINTS
from gaze_targets import joints_at
from hypothesis import given
from hypothesis import strategies as st

from gazerig.gaze.angles import angle_between, angles_of, norm, rotate, rotate_back, rotation, sub
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import GazeCommand
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

GEOMETRY = GeometryParams(62.0, 38.0, 51.0)
KINEMATICS = Kinematics(
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
) -> None:
    angles = (head[0] * 1.2, head[1] * 0.6, head[2] * 0.5)
    R, p = KINEMATICS.head_pose(angles)
    left, right = KINEMATICS.eye_angles_to(point, R, p)
    state = KINEMATICS.forward(joints_at(*left, *right, 0.0, 0.0, *angles))
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
) -> None:
    command = GazeCommand(
        head, (q[0], q[1]), (q[2], q[3]), *lids, "fixate", False, (1.0, 0.0, 0.0), 0, 0, 0
    )
    state = KINEMATICS.forward(joints_at(*KINEMATICS.inverse(command)))
    assert state.head_rad == head
    assert (*state.eye_left_rad, *state.eye_right_rad) == q
    assert (state.lid_left, state.lid_right) == pytest.approx(lids, abs=1e-9)


@given(
    point=st.tuples(st.floats(0.3, 5.0), st.floats(-2.0, 2.0), st.floats(-1.0, 1.5)),
)
def test_facing_leads_the_head_axis_through_the_point(point: tuple[float, float, float]) -> None:
    yaw, pitch = KINEMATICS.neck_angles_to(point)
    R, p = KINEMATICS.head_pose((yaw, pitch, 0.0))
    assert angle_between(rotate(R, (1.0, 0.0, 0.0)), sub(point, p)) < 1e-9


@given(st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)))
def test_rotations_turn_back(angles: tuple[float, float, float]) -> None:
    R = rotation(angles)
    assert angles_of(R) == pytest.approx(angles, abs=1e-9)
    v = (0.3, -1.2, 0.7)
    assert rotate_back(R, rotate(R, v)) == pytest.approx(v, abs=1e-12)
    assert np.linalg.det(np.array(R)) == pytest.approx(1.0)


def test_signs_are_left_up_and_right_ear_down() -> None:
    R, _ = KINEMATICS.head_pose((radians(10), 0.0, 0.0))
    assert rotate(R, (1.0, 0.0, 0.0))[1] > 0.0
    R, _ = KINEMATICS.head_pose((0.0, radians(10), 0.0))
    assert rotate(R, (1.0, 0.0, 0.0))[2] > 0.0
    R, _ = KINEMATICS.head_pose((0.0, 0.0, radians(10)))
    assert rotate(R, (0.0, -1.0, 0.0))[2] < 0.0


def test_eyes_are_where_the_geometry_says() -> None:
    state = KINEMATICS.forward(joints_at(*[0.0] * 9))
    assert state.p_world_head_m == pytest.approx((0.038, 0.0, 0.113))
    gap = sub(state.p_world_eye_left_m, state.p_world_eye_right_m)
    assert norm(gap) == pytest.approx(0.0619)
    assert gap[1] > 0.0


ONE_PAN = Kinematics(GEOMETRY, ("eyes_pan", "eyes_tilt"), {})


@given(angle=st.floats(-3.14, 3.14), far=st.floats(0.3, 5.0))
def test_eyes_on_one_linkage_point_between_what_each_would_need(angle: float, far: float) -> None:
    R, p = ONE_PAN.head_pose((0.0, 0.0, 0.0))
    point = (p[0] + far * cos(angle), far * sin(angle), p[2])
    left, right = ONE_PAN.eye_angles_to(point, R, p)
    assert left == right
    off = abs(left[0] - angle)
    # Next to the head one eye is nearer, so the mean is not quite that of the middle.
    assert min(off, 2.0 * pi - off) < 0.01 / far


def test_eyes_on_one_linkage_turn_to_the_end_for_a_point_straight_behind() -> None:
    R, p = ONE_PAN.head_pose((0.0, 0.0, 0.0))
    for aside in (-0.05, -0.001, 0.0, 0.001, 0.05):
        (pan, _), _ = ONE_PAN.eye_angles_to((p[0] - 1.0, aside, p[2]), R, p)
        assert abs(pan) > 3.0
        assert pan * aside >= 0.0

"""Poses come back out of the pictures they made, and what is no face from its front does not."""

from math import atan2, degrees, pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from posed_faces import CAMERA, angle_between, image_of, turned

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.face_pose import FacePose, face_pose


def yaw_of(R_camera_face: np.ndarray) -> float:
    """Yaw of a face about its upright axis, + to its own left; 0 along the optical axis."""
    outward = R_camera_face[:, 0]
    return atan2(outward[0], -outward[2])


def reprojection_px(pose: FacePose, landmarks_px: np.ndarray) -> float:
    """Root mean square distance of landmarks from those of a face with this pose."""
    face_m = LANDMARKS_FACE_M * (1.0, 1.0, pose.length)
    off = image_of_points(face_m, np.array(pose.R_camera_face), pose.p_camera_m) - landmarks_px
    return float(np.sqrt((off * off).sum() / 5.0))


def image_of_points(face_m: np.ndarray, R: np.ndarray, p) -> np.ndarray:
    return project(face_m @ R.T + p, CAMERA)


def pose_of(landmarks_px: np.ndarray) -> tuple[FacePose, np.ndarray, np.ndarray]:
    pose = face_pose(landmarks_px, CAMERA)
    assert pose is not None
    return pose, np.array(pose.R_camera_face), np.array(pose.p_camera_m)


@settings(max_examples=60, deadline=None)
@given(
    yaw=st.floats(-45, 45),
    pitch=st.floats(-30, 30),
    roll=st.floats(-40, 40),
    x=st.floats(-0.4, 0.4),
    y=st.floats(-0.3, 0.3),
    z_m=st.floats(0.3, 2.5),
)
def test_noiseless_pose_comes_back(yaw, pitch, roll, x, y, z_m):
    R, p = turned(radians(yaw), radians(pitch), radians(roll)), np.array([x, y, 1.0]) * z_m
    pose, found_R, found_p = pose_of(image_of(R, p))
    # What is left is the belief that faces look here; it weighs more the smaller the face and the
    # farther it is turned, and a mouth's height, which smiles change, hardly speaks against it.
    far = z_m > 1.0
    facing = degrees(np.arccos(-R[:, 0] @ p / np.linalg.norm(p))) < 25.0
    if facing:
        most_deg, most_part = (9.0, 0.014) if far else (5.0, 0.01)
    else:
        most_deg, most_part = (19.0, 0.042) if far else (15.0, 0.03)
    assert degrees(angle_between(R, found_R)) < most_deg
    assert np.linalg.norm(found_p - p) < most_part * np.linalg.norm(p)
    if facing:
        assert reprojection_px(pose, image_of(R, p)) < 2.2
    assert np.allclose(found_R @ found_R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(found_R) == pytest.approx(1.0)


def errors_over_grid(eyes_px: float, noise_px: float) -> np.ndarray:
    """(n, 2) yaw errors in degrees and distance errors in percent, |yaw| up to 35 deg."""
    rng = np.random.default_rng(5)
    z_m = CAMERA.fx_px * 0.0619 / eyes_px
    errors = []
    for yaw in range(-35, 36, 7):
        for pitch in (-20, 0, 20):
            for roll in (-30, 0, 30):
                for aside in (0.0, 0.3):
                    R = turned(radians(yaw), radians(pitch), radians(roll))
                    p = np.array([aside * z_m, -0.2 * aside * z_m, z_m])
                    seen = image_of(R, p) + rng.normal(0.0, noise_px, (5, 2))
                    _, found_R, found_p = pose_of(seen)
                    off = degrees(yaw_of(found_R) - yaw_of(R))
                    away = np.linalg.norm(found_p) / np.linalg.norm(p) - 1.0
                    errors.append((off, 100.0 * away))
    return np.array(errors)


def test_one_pixel_of_noise_on_a_near_face():
    yaw_deg, distance_percent = errors_over_grid(eyes_px=60, noise_px=1.0).T
    assert np.abs(yaw_deg).max() < 10.0
    assert np.abs(distance_percent).max() < 8.0
    assert yaw_deg.std() < 3.0
    assert distance_percent.std() < 2.2
    assert abs(distance_percent.mean()) < 0.5


@pytest.mark.parametrize("yaw_deg", [180, 150, 110, 89, -120, 80])
def test_face_turned_away_is_no_face(yaw_deg):
    R = turned(radians(yaw_deg), 0.0, 0.0)
    assert face_pose(image_of(R, np.array([0.0, 0.0, 0.6])), CAMERA) is None


def test_mirrored_landmarks_are_no_face():
    seen = image_of(turned(0.2, 0.0, 0.0), np.array([0.0, 0.0, 0.6]))
    assert face_pose(seen, CAMERA) is not None
    assert face_pose(seen[[1, 0, 2, 4, 3]], CAMERA) is None


@pytest.mark.parametrize("landmarks", [np.zeros((5, 2)), np.full((5, 2), np.nan), np.zeros((4, 2))])
def test_points_that_are_no_face_give_none(landmarks):
    assert face_pose(landmarks, CAMERA) is None


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), min_size=5, max_size=5),
    st.sampled_from([1.0, 1e-3, 1e-9]),
)
def test_any_points_give_none_or_finite_numbers(points, scale):
    pose = face_pose(np.array(points) * scale, CAMERA)
    if pose is not None:
        numbers = [*pose.p_camera_m, *np.ravel(pose.R_camera_face), pose.length]
        assert np.isfinite([*numbers, reprojection_px(pose, np.array(points) * scale)]).all()
        assert pose.p_camera_m[2] > 0.0


FRONTAL_M = LANDMARKS_FACE_M @ np.array([(0, 1, 0), (0, 0, -1), (-1, 0, 0)], float).T


def smiling(wider: float) -> np.ndarray:
    """The five points of a frontal face whose mouth is wider by a part of itself: a smile."""
    face_m = FRONTAL_M.copy()
    face_m[3:] += 0.0255 * wider * np.array([(-1.0, -1.0, 0.87), (1.0, -1.0, 0.87)])
    return face_m


def test_without_noise_a_smile_is_no_nod():
    for wider in (-0.15, 0.15, 0.3):
        _, found_R, _ = pose_of(project(smiling(wider) + (0.0, 0.0, 0.5), CAMERA))
        assert abs(degrees(angle_between(turned(0.0, 0.0, 0.0), found_R))) < 3.5


# ---- camera -----------------------------------------------------------------------------


def test_field_of_view_reaches_from_edge_to_edge():
    camera = intrinsics_of_view(radians(90.0), 640, 400)
    assert camera.fx_px == camera.fy_px == pytest.approx(320.0)
    left, right = project([(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0)], camera)
    assert left == pytest.approx([-0.5, 199.5])
    assert right == pytest.approx([639.5, 199.5])


def test_unequal_focal_lengths_are_used():
    camera = Intrinsics(600.0, 500.0, 300.0, 200.0)
    R, p = turned(0.3, -0.1, 0.2), np.array([0.1, 0.05, 0.7])
    pose = face_pose(project(LANDMARKS_FACE_M @ R.T + p, camera), camera)
    assert pose is not None
    assert np.linalg.norm(np.array(pose.p_camera_m) - p) < 0.005


@pytest.mark.parametrize("view_rad", [0.0, -1.0, pi, float("nan")])
def test_impossible_fields_of_view_are_refused(view_rad):
    with pytest.raises(ValueError, match="field of view"):
        intrinsics_of_view(view_rad, 640, 480)

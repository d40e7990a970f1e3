"""A click in the picture means the thing that is seen there."""

from collections.abc import Callable

import numpy as np
import pytest
from desk import GAZE_JOINTS

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import Detections
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Bodies, Face, Percept, Vec3
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.perception.perception import USUAL_M, PixelToWorld, seen_distance_m

CAMERA = CameraParams(position_mm=(20.0, 0.0, 45.0), horizontal_field_deg=70.0)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
WIDTH, HEIGHT = 640, 480


def looking(
    head_rad: tuple[float, float, float], percept: Percept | None, depth: np.ndarray | None = None
) -> tuple[Callable[[float, float], Vec3 | None], CameraMount, PoseHistory]:
    """A head that was turned so when the picture was taken, and has turned on since."""
    kinematics = Kinematics(
        GeometryParams(pitch_axis_height_mm=90.0, eyes_ahead_mm=30.0, eyes_above_mm=50.0),
        GAZE_JOINTS,
        {"left_upper_lid": (0.0, 0.5), "right_upper_lid": (0.0, 0.5)},
    )
    poses = PoseHistory(kinematics)
    for t_s in (0.9, 1.0):
        poses.remember(t_s, head_rad)
    poses.remember(1.1, (head_rad[0] + 0.3, 0.0, 0.0))
    mount = CameraMount(CAMERA)
    pixels = PixelToWorld(mount, poses, lambda: CAMERA)
    found = Detections(1.0, 1, WIDTH, HEIGHT, (), (), None, depth, None)

    def point(x: float, y: float) -> Vec3 | None:
        return pixels.point((x * (WIDTH - 1), y * (HEIGHT - 1)), found, percept)

    return point, mount, poses


def place(p_world_m: Vec3, mount: CameraMount, poses: PoseHistory) -> tuple[float, float]:
    """Return the place of a point in the picture, 0..1."""
    R, p = mount.pose(*poses.head_pose(1.0))
    in_camera = np.array(R).T @ np.array(sub(p_world_m, p))
    lens = intrinsics_of_view(np.radians(70.0), WIDTH, HEIGHT)
    x, y = project(in_camera[None], lens)[0]
    return float(x) / (WIDTH - 1), float(y) / (HEIGHT - 1)


def face_at(p_world_m: Vec3) -> Face:
    return Face(3, p_world_m, (0.0, 0.0, 0.0), AXES, (p_world_m,) * 8, 0.9)


@pytest.mark.parametrize("yaw_rad", [-0.5, 0.0, 0.4])
def test_a_click_on_a_face_is_at_the_face(yaw_rad):
    # Somebody before the camera as it stood when the picture was taken.
    there: Vec3 = (0.9 * np.cos(yaw_rad), 0.9 * np.sin(yaw_rad) + 0.05, 0.22)
    point_at, mount, poses = looking((yaw_rad, 0.0, 0.0), Percept(1.0, Bodies(), (face_at(there),)))
    x, y = place(there, mount, poses)
    assert 0.0 < x < 1.0 and 0.0 < y < 1.0
    point = point_at(x, y)
    assert point is not None and norm(sub(point, there)) < 1e-6


def test_depth_is_along_the_optical_axis():
    depth = np.full((HEIGHT, WIDTH), 2.0, np.float32)
    depth[:, : WIDTH // 2] = 0.7
    point_at, mount, poses = looking((0.0, 0.0, 0.0), None, depth)
    _, p = mount.pose(*poses.head_pose(1.0))
    left, right = point_at(0.1, 0.5), point_at(0.9, 0.5)
    assert left is not None and right is not None
    assert left[0] - p[0] == pytest.approx(0.7, abs=1e-3)
    assert right[0] - p[0] == pytest.approx(2.0, abs=1e-3)


def test_the_nearest_direction_wins():
    zero = np.zeros((1, 3))
    bodies = Bodies((1,), ("hand",), np.array([(0.5, 0.03, 0.0)]), zero, zero, np.ones(1))
    percept = Percept(0.0, bodies, (face_at((2.0, 0.0, 0.0)),))
    here = (0.0, 0.0, 0.0)
    assert seen_distance_m(percept, here, (1.0, 0.0, 0.0)) == pytest.approx(2.0)
    away = float(np.hypot(0.5, 0.03))
    to_hand = (0.5 / away, 0.03 / away, 0.0)
    assert seen_distance_m(percept, here, to_hand) == pytest.approx(0.5, abs=0.01)
    assert seen_distance_m(None, here, (1.0, 0.0, 0.0)) == USUAL_M

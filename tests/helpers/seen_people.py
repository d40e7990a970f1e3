"""What a camera that stands still finds of people, and the percepts of it."""

from math import radians
from typing import Any

import numpy as np
from stand_in import StandIn

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import DetectedFace, Detections
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Angles3, Mat3, Percept, Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.perception import Perception

WIDTH, HEIGHT = 640, 400
LENS = intrinsics_of_view(radians(69.0), WIDTH, HEIGHT)
# A face that looks into the camera: its axes in the camera frame.
FRONTAL = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)])
AT_EYES = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
STILL = CameraMount(CameraParams(mount="base", position_mm=(0.0, 0.0, 0.0)))


class Neck(StandIn):
    """A head that turns about the origin."""

    def head_pose(self, head_rad: Angles3) -> tuple[Mat3, Vec3]:
        return rotation(head_rad), (0.0, 0.0, 0.0)


def standing() -> PoseHistory:
    poses = PoseHistory(Neck())
    poses.remember(0.0, (0.0, 0.0, 0.0))
    return poses


def face_at(p_camera_m: Vec3, size: float = 1.0) -> DetectedFace:
    points = project(size * LANDMARKS_FACE_M @ FRONTAL.T + p_camera_m, LENS)
    (x, y), (right, bottom) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return DetectedFace((x, y, right - x, bottom - y), points, 0.9)


def picture(number: int, **found: Any) -> Detections:
    return Detections(number / 30, number, WIDTH, HEIGHT, **found)


def seen(perception: Perception, number: int, **found: Any) -> Percept:
    percept = perception.see(picture(number, **found), standing())
    assert percept is not None
    return percept

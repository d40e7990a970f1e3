"""Faces with a pose before a camera, and their landmarks in its picture."""

from math import atan2, cos, hypot, radians, sin

import numpy as np

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.intrinsics import project

CAMERA = intrinsics_of_view(radians(65.0), 640, 480)


def turned(yaw_rad: float, pitch_rad: float, roll_rad: float) -> np.ndarray:
    """R_camera_face of a face that looks along the optical axis, then turns: z, y, x."""
    frontal = np.array([(0, 1, 0), (0, 0, -1), (-1, 0, 0)], float)
    cy, sy, cp, sp = cos(yaw_rad), sin(yaw_rad), cos(pitch_rad), sin(pitch_rad)
    cr, sr = cos(roll_rad), sin(roll_rad)
    Rz = np.array([(cy, -sy, 0), (sy, cy, 0), (0, 0, 1)])
    Ry = np.array([(cp, 0, -sp), (0, 1, 0), (sp, 0, cp)])
    Rx = np.array([(1, 0, 0), (0, cr, -sr), (0, sr, cr)])
    return frontal @ Rz @ Ry @ Rx


def angle_between(R: np.ndarray, S: np.ndarray) -> float:
    """Angle of the rotation from one to the other."""
    axis = R.T @ S - (R.T @ S).T
    sine = hypot(axis[0, 1], axis[0, 2], axis[1, 2]) / 2
    return atan2(sine, (np.trace(R.T @ S) - 1) / 2)


def image_of(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    return project(LANDMARKS_FACE_M @ R.T + p, CAMERA)

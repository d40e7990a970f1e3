"""The calibration board and the desk's head, and corners as a detector finds them."""

import numpy as np
from desk import GAZE_JOINTS, LIDS

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.charuco_board import CharucoBoard, SeenBoard
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

SIZE = (640, 400)
BOARD = CharucoBoard()
KINEMATICS = Kinematics(GeometryParams(70.0, 38.0, 55.0), GAZE_JOINTS, LIDS)
RANGES = ((-1.2, 1.2), (-0.5, 0.5), (-0.35, 0.35))
"""Yaw, pitch and roll of the desk rig's neck, rad."""


def seen_board(
    R: Mat3, p: Vec3, lens: Intrinsics, noise_px: float, rng: np.random.Generator
) -> SeenBoard:
    """Return the corners that a detector would find, without a picture."""
    px = project(BOARD.corners_m @ np.array(R).T + p, lens)
    inside = ((px > 0.0) & (px < np.array(SIZE) - 1.0)).all(axis=1)
    px += rng.normal(0.0, noise_px, px.shape)
    return SeenBoard(np.flatnonzero(inside), px[inside], BOARD.corners_m[inside])

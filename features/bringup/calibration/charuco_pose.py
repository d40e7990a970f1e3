"""Where the board is in the camera frame, from one image of it. Pure.

Frames as in gazerig.robot.model.charuco_board and gazerig.robot.model.intrinsics. A flat
board seen from far has two poses that explain it nearly as well, mirrored about the line of sight;
both are given.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.robot.model.charuco_board import LEAST_CORNERS, SeenBoard

Floats = NDArray[np.float64]


class BoardPose(NamedTuple):
    """R_camera_board (3, 3), p_camera_board_m (3,), and the root mean square error in pixels."""

    R_camera_board: Floats
    p_camera_board_m: Floats
    error_px: float


def board_poses(seen: SeenBoard, lens: Intrinsics) -> tuple[BoardPose, ...]:
    """Return the one or two poses that explain the corners, the better one first."""
    if len(seen.ids) < LEAST_CORNERS:
        return ()
    points, corners = seen.corners_board_m, seen.corners_px[:, None]
    matrix, bends = lens.matrix, np.array(lens.distortion)
    try:
        _, turns, places, _ = cv2.solvePnPGeneric(
            points, corners, matrix, bends, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:  # corners that no plane could show
        return ()
    found = []
    for start_turn, start_place in zip(turns, places, strict=True):
        turn, place = cv2.solvePnPRefineLM(
            points, corners, matrix, bends, start_turn.copy(), start_place.copy()
        )
        shown, _ = cv2.projectPoints(points, turn, place, matrix, bends)
        error = float(np.sqrt(((shown - corners) ** 2).sum(axis=2).mean()))
        if np.isfinite(error) and place[2, 0] > 0.0:
            rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
            found.append(BoardPose(rotation, np.asarray(place, dtype=np.float64)[:, 0], error))
    return tuple(sorted(found, key=lambda pose: pose.error_px))

"""Views of the ChArUco board: its pose, and the views that a lens calibration needs. Pure.

Only a tilted board determines the focal length of a lens, and only views near the edges of the
image its centre and distortion. Many similar views fit well but determine little.
Frames as in gazerig.drivers.vision.charuco_board and gazerig.robot.model.intrinsics.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.vision.charuco_board import DetectedBoard

Floats = NDArray[np.float64]

LEAST_VIEWS, MOST_VIEWS = 12, 60
_EDGE, _TILT_DEG, _NEAR = 0.12, 15.0, 0.4
# A view is new if the board has moved by a share of the image, or tilted.
_NEW_SHARE, _NEW_DEG = 0.07, 8.0
# What a person is told, and the value that one view must reach.
_GOALS = (
    ("bring the board to the left edge of the image", -_EDGE),
    ("bring the board to the right edge", 1.0 - _EDGE),
    ("bring the board to the upper edge", -_EDGE),
    ("bring the board to the lower edge", 1.0 - _EDGE),
    ("tilt the board, its right side nearer", _TILT_DEG),
    ("tilt the board, its left side nearer", _TILT_DEG),
    ("tilt the board, its lower side nearer", _TILT_DEG),
    ("tilt the board, its upper side nearer", _TILT_DEG),
    ("hold the board nearer", _NEAR),
)


def board_pose(seen: DetectedBoard, lens: Intrinsics) -> tuple[Floats, Floats] | None:
    """Return R_camera_board (3, 3) and p_camera_board_m (3,) of the best pose, None without one."""
    try:
        found, turn, place = cv2.solvePnP(
            seen.corners_board_m, seen.corners_px[:, None], lens.matrix, np.array(lens.distortion),
            flags=cv2.SOLVEPNP_IPPE,
        )  # fmt: skip
    except cv2.error:  # corners that are impossible for a plane
        return None
    if not found or not place[2, 0] > 0.0:
        return None
    return np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64), np.asarray(
        place, dtype=np.float64
    )[:, 0]


def board_view(
    seen: DetectedBoard, guess: Intrinsics, width_px: int, height_px: int
) -> Floats | None:
    """Return what a view shows, in the order of the goals; None without a pose.

    (9,): the farthest corners to the left (negative), right, top (negative) and bottom, 0..1; tilt
    of the right, left, lower and upper side towards the camera, degrees; larger extent, 0..1.

    guess: an approximate lens; the field of view of the data sheet is sufficient
    """
    pose = board_pose(seen, guess)
    if pose is None:
        return None
    share = (seen.corners_px + 0.5) / (width_px, height_px)
    low, high = share.min(axis=0), share.max(axis=0)
    right, down = np.degrees(np.arcsin(np.clip(pose[0][:2, 2], -1.0, 1.0)))
    size = (high - low).max()
    return np.array(
        (-low[0], high[0], -low[1], high[1], right, -right, down, -down, size), dtype=np.float64
    )


class ViewCollector:
    """Keeps the views that add information."""

    def __init__(self, guess: Intrinsics, width_px: int, height_px: int) -> None:
        self._guess, self._size = guess, (width_px, height_px)
        self._shown = np.empty((0, len(_GOALS)))
        self.views: list[DetectedBoard] = []

    @property
    def missing(self) -> str:
        """Return the next instruction for a person, "" when the views are sufficient."""
        best = self._shown.max(axis=0, initial=-np.inf)
        for (instruction, wanted), reached in zip(_GOALS, best, strict=True):
            if reached < wanted:
                return instruction
        short = LEAST_VIEWS - len(self.views)
        return f"show {short} more views, each a new one" if short > 0 else ""

    def offer(self, seen: DetectedBoard | None) -> str:
        """Keep a view if it is new; return the reason if it was not kept, else ""."""
        if seen is None:
            return "no board seen"
        shown = board_view(seen, self._guess, *self._size)
        if shown is None:
            return "the board's pose cannot be found"
        off = np.abs(self._shown - shown)
        moved, tilted = off[:, :4].max(axis=1, initial=0.0), np.hypot(off[:, 4], off[:, 6])
        if ((moved < _NEW_SHARE) & (tilted < _NEW_DEG)).any():
            return "too much like a view before"
        if len(self.views) >= MOST_VIEWS:
            return "there are views enough"
        self._shown = np.vstack((self._shown, shown))
        self.views.append(seen)
        return ""

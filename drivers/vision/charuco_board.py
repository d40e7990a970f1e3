"""ChArUco board for camera calibration: its dimensions and its detection in images.

It is a chessboard whose white squares carry ArUco markers, so that every corner has a known
number even if a part of the board is outside the image (OpenCV manual, "Detection of ChArUco
Boards"). Board frame: origin at its upper left corner, x right, y down, z into the board, in m.
Pixels have their centres at whole numbers.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import ImageArray

Floats = NDArray[np.float64]

COLUMNS, ROWS = 7, 5
SQUARE_MM, MARKER_MM = 36.0, 27.0
"""Squares, and the side lengths of squares and markers: fits on A4 and on Letter in landscape."""
# Markers with few and large modules can be read from farther away.
_MARKERS = cv2.aruco.DICT_4X4_50
# Fewer corners, or corners on one line, determine neither lens nor pose.
_LEAST_CORNERS = 6


class DetectedBoard(NamedTuple):
    """The corners of the board found in one image.

    Attributes:
        ids: (n,) Numbers of the inner corners, row by row from 0.
        corners_px: (n, 2) Pixels.
        corners_board_m: (n, 3) Positions in the board frame, z = 0.
    """

    ids: NDArray[np.int64]
    corners_px: Floats
    corners_board_m: Floats


class CharucoBoard:
    """The board, which can be drawn and found in images.

    Attributes:
        corners_m: (n, 3) Positions of all inner corners in the board frame.
        size_m: Width and height.

    Args:
        scale: Factor by which the print is larger than defined.
    """

    def __init__(self, scale: float = 1.0) -> None:
        square_m, marker_m = scale * SQUARE_MM / 1e3, scale * MARKER_MM / 1e3
        self._board = cv2.aruco.CharucoBoard(
            (COLUMNS, ROWS), square_m, marker_m, cv2.aruco.getPredefinedDictionary(_MARKERS)
        )
        self._detector = cv2.aruco.CharucoDetector(self._board)
        self.corners_m: Floats = np.array(self._board.getChessboardCorners(), dtype=np.float64)
        self.size_m = COLUMNS * square_m, ROWS * square_m

    def find(self, image: ImageArray) -> DetectedBoard | None:
        """Find the board's inner corners; return None if too few are visible.

        Args:
            image: (h, w), (h, w, 1), BGR or BGRA.
        """
        if image.ndim not in (2, 3) or min(image.shape[:2]) < 16:
            return None
        if image.ndim == 3 and image.shape[2] >= 3:
            image = np.asarray(cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        grey = np.ascontiguousarray(image.reshape(image.shape[:2]))
        corners, ids, _, _ = self._detector.detectBoard(grey)
        if ids is None or len(ids) < _LEAST_CORNERS:
            return None
        numbers = np.asarray(ids, dtype=np.int64).ravel()
        places: Floats = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
        on_board_m = self.corners_m[numbers]
        flat_m = on_board_m[:, :2] - on_board_m[:, :2].mean(axis=0)
        # Corners on a line determine no pose.
        if np.linalg.matrix_rank(flat_m, tol=1e-6) < 2 or not np.isfinite(places).all():
            return None
        return DetectedBoard(numbers, places, on_board_m)

    def image(self, px_per_mm: float) -> ImageArray:
        """Draw the board, edge to edge, black on white.

        Args:
            px_per_mm: Scale. Squares and marker modules are exact if their sides are whole
                pixels.
        """
        width, height = (round(1e3 * side_m * px_per_mm) for side_m in self.size_m)
        return np.asarray(self._board.generateImage((width, height)), dtype=np.uint8)

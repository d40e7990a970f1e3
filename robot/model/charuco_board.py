"""ChArUco board for camera calibration: its dimensions and its detection in images.

It is a chessboard whose white squares carry ArUco markers, so that every corner has a known
number even if a part of the board is outside the image (OpenCV manual, "Detection of ChArUco
Boards"). Board frame: origin at its upper left corner, x right, y down, z into the board, in m.
Pixels have their centres at whole numbers.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import ImageArray
from gazerig.params import Bounds

Floats = NDArray[np.float64]

# Markers with few and large modules can be read from farther away.
_MARKERS = cv2.aruco.DICT_4X4_50
# Fewer corners, or corners on one line, determine neither lens nor pose.
LEAST_CORNERS = 6


@dataclass(frozen=True)
class BoardParams:
    """Dimensions of the board. The default fits on A4 and on Letter in landscape format."""

    columns: Annotated[int, Bounds(3, 20), "number of squares from left to right"] = 7
    rows: Annotated[int, Bounds(3, 20), "number of squares from top to bottom"] = 5
    square_mm: Annotated[float, Bounds(2, 500), "side length of a square"] = 36.0
    marker_mm: Annotated[float, Bounds(1, 500), "side length of a marker"] = 27.0

    def scaled(self, factor: float) -> "BoardParams":
        """Return the board as printed with a scale factor."""
        return BoardParams(
            self.columns, self.rows, self.square_mm * factor, self.marker_mm * factor
        )


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
    """A ChArUco board, which can be drawn and found in images."""

    def __init__(self, params: BoardParams | None = None) -> None:
        self.params = par = params if params is not None else BoardParams()
        self._board = cv2.aruco.CharucoBoard(
            (par.columns, par.rows),
            par.square_mm / 1e3,
            par.marker_mm / 1e3,
            cv2.aruco.getPredefinedDictionary(_MARKERS),
        )
        self._detector = cv2.aruco.CharucoDetector(self._board)
        self.corners_m: Floats = np.array(self._board.getChessboardCorners(), dtype=np.float64)
        self.size_m = (par.columns * par.square_mm / 1e3, par.rows * par.square_mm / 1e3)

    def find(self, image: ImageArray) -> DetectedBoard | None:
        """Find the board's inner corners; return None if too few are visible.

        Args:
            image: (h, w), (h, w, 1), BGR or BGRA.
        """
        grey = _grey(image)
        if grey is None:
            return None
        corners, ids, _, _ = self._detector.detectBoard(grey)
        if ids is None or len(ids) < LEAST_CORNERS:
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
        par = self.params
        width = round(par.columns * par.square_mm * px_per_mm)
        height = round(par.rows * par.square_mm * px_per_mm)
        return np.asarray(self._board.generateImage((width, height)), dtype=np.uint8)


def _grey(image: ImageArray) -> ImageArray | None:
    """Return the image in grey, None if it is too small or not an image."""
    if image.ndim not in (2, 3) or min(image.shape[:2]) < 16:
        return None
    if image.ndim == 2 or image.shape[2] == 1:
        return np.ascontiguousarray(image.reshape(image.shape[:2]))
    code = {3: cv2.COLOR_BGR2GRAY, 4: cv2.COLOR_BGRA2GRAY}.get(image.shape[2])
    return None if code is None else np.asarray(cv2.cvtColor(image, code), dtype=np.uint8)

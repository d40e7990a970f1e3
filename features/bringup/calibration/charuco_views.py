"""Views of the ChArUco board: its pose, and the views that a lens calibration needs. Pure.

Only a tilted board determines the focal length of a lens, and only views near the edges of the
image its centre and distortion. Many similar views fit well but determine little.

Frames as in gazerig.robot.model.charuco_board and gazerig.robot.model.intrinsics. A flat
board seen from far has two poses that explain it nearly equally well, mirrored about the line of
sight; both are returned.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, degrees, hypot
from pathlib import Path
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import output_file
from gazerig.drivers.types import ImageArray
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import LEAST_CORNERS, CharucoBoard, DetectedBoard

Floats = NDArray[np.float64]


class BoardPose(NamedTuple):
    """R_camera_board (3, 3), p_camera_board_m (3,), and the root mean square error in pixels."""

    R_camera_board: Floats
    p_camera_board_m: Floats
    error_px: float


def board_poses(seen: DetectedBoard, lens: Intrinsics) -> tuple[BoardPose, ...]:
    """Return the one or two poses that explain the corners, the better one first."""
    if len(seen.ids) < LEAST_CORNERS:
        return ()
    points, corners = seen.corners_board_m, seen.corners_px[:, None]
    matrix, bends = lens.matrix, np.array(lens.distortion)
    try:
        _, turns, places, _ = cv2.solvePnPGeneric(
            points, corners, matrix, bends, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:  # corners that are impossible for a plane
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


@dataclass(frozen=True)
class ViewParams:
    """Required number of views, and differences between them."""

    # fmt: off
    least_views: Annotated[int, Bounds(4, 200), "fewer are refused"] = 12
    most_views: Annotated[int, Bounds(4, 500), "more are not kept"] = 60
    edge_share: Annotated[float, Bounds(0.01, 0.4), "a corner nearer to an edge, as a share of the image, has reached it"] = 0.12
    least_tilt_deg: Annotated[float, Bounds(2, 60), "counts as tilted"] = 15.0
    near_share: Annotated[float, Bounds(0.05, 1), "the board is near where its corners span this share of width or height"] = 0.4
    new_share: Annotated[float, Bounds(0, 0.5), "a view is new if the board has moved or grown by this share of the image"] = 0.07
    new_tilt_deg: Annotated[float, Bounds(0, 60), "or tilted by this angle"] = 8.0
    # fmt: on


class BoardView(NamedTuple):
    """Position and tilt of the board in one view.

    left, right, top, bottom: limits of its corners in the image, 0..1
    tilt_right_deg: right edge nearer; tilt_down_deg: bottom edge nearer
    """

    left: float
    right: float
    top: float
    bottom: float
    tilt_right_deg: float
    tilt_down_deg: float

    def differs(self, other: "BoardView", params: ViewParams) -> bool:
        """Return whether it is sufficiently different from another view."""
        moved = max(abs(a - b) for a, b in zip(self[:4], other[:4], strict=True))
        tilted = hypot(
            self.tilt_right_deg - other.tilt_right_deg, self.tilt_down_deg - other.tilt_down_deg
        )
        return moved >= params.new_share or tilted >= params.new_tilt_deg


class Coverage(NamedTuple):
    """Coverage of the kept views, and the next instructions for a person.

    views: number of kept views; missing: instructions, empty when the views are sufficient
    """

    views: int
    missing: tuple[str, ...]

    @property
    def enough(self) -> bool:
        """Return whether the views are sufficient for a calibration."""
        return not self.missing


def board_view(
    seen: DetectedBoard, guess: Intrinsics, width_px: int, height_px: int
) -> BoardView | None:
    """Return position and tilt of the board, None if its pose cannot be found.

    guess: an approximate lens; the field of view of the data sheet is sufficient
    """
    poses = board_poses(seen, guess)
    if not poses:
        return None
    share = (seen.corners_px + 0.5) / (width_px, height_px)
    (left, top), (right, bottom) = share.min(axis=0).tolist(), share.max(axis=0).tolist()
    into_x, into_y, _ = np.clip(poses[0].R_camera_board[:, 2], -1.0, 1.0).tolist()
    return BoardView(left, right, top, bottom, degrees(asin(into_x)), degrees(asin(into_y)))


def coverage(views: Sequence[BoardView], params: ViewParams) -> Coverage:
    """Return the coverage of views, and what is missing."""
    edge, tilt = params.edge_share, params.least_tilt_deg
    goals = {
        "bring the board to the left edge of the image": any(v.left <= edge for v in views),
        "bring the board to the right edge": any(v.right >= 1.0 - edge for v in views),
        "bring the board to the upper edge": any(v.top <= edge for v in views),
        "bring the board to the lower edge": any(v.bottom >= 1.0 - edge for v in views),
        "tilt the board, its right side nearer": any(v.tilt_right_deg >= tilt for v in views),
        "tilt the board, its left side nearer": any(v.tilt_right_deg <= -tilt for v in views),
        "tilt the board, its lower side nearer": any(v.tilt_down_deg >= tilt for v in views),
        "tilt the board, its upper side nearer": any(v.tilt_down_deg <= -tilt for v in views),
        "hold the board nearer": any(
            max(v.right - v.left, v.bottom - v.top) >= params.near_share for v in views
        ),
    }
    missing = [desired for desired, there in goals.items() if not there]
    short = params.least_views - len(views)
    if short > 0:
        missing.append(f"show {short} more {'view' if short == 1 else 'views'}, each a new one")
    return Coverage(len(views), tuple(missing))


class ViewCollector:
    """Keeps the views that add information."""

    def __init__(
        self, guess: Intrinsics, width_px: int, height_px: int, params: ViewParams | None = None
    ) -> None:
        self.params = params if params is not None else ViewParams()
        self._guess, self._size = guess, (width_px, height_px)
        self._held: list[BoardView] = []
        self.views: list[DetectedBoard] = []

    @property
    def coverage(self) -> Coverage:
        """Return the coverage of the kept views, and what is missing."""
        return coverage(self._held, self.params)

    def offer(self, seen: DetectedBoard | None) -> str:
        """Keep a view if it is new; return the reason if it was not kept, else ""."""
        if seen is None:
            return "no board seen"
        how = board_view(seen, self._guess, *self._size)
        if how is None:
            return "the board's pose cannot be found"
        if not all(how.differs(other, self.params) for other in self._held):
            return "too much like a view before"
        if len(self.views) >= self.params.most_views:
            return "there are views enough"
        self._held.append(how)
        self.views.append(seen)
        return ""


# --- The board on paper: a page in true size, with a ruler to check what the printer did


PAPERS_MM: dict[str, tuple[float, float]] = {"a4": (297.0, 210.0), "letter": (279.4, 215.9)}
"""Width and height of the paper in landscape format."""

RULER_MM = 100
"""Length of the ruler on the page."""

# A whole number of pixels per millimetre keeps squares and marker modules exact.
_PX_PER_MM = 12
_DPI = _PX_PER_MM * 25.4
# No printer reaches the edge; the strip below the board contains ruler and text.
_EDGE_MM, _STRIP_MM = 5.0, 13.0
_BLACK = 0


def board_page(board: CharucoBoard, paper: str) -> ImageArray:
    """Draw the page: (h, w) grey, 12 px per millimetre.

    Raises:
        SetupError: the paper is unknown, or the board is too large for it.
    """
    if paper not in PAPERS_MM:
        raise SetupError(f"paper {paper!r}: unknown; there is {', '.join(PAPERS_MM)}")
    wide_mm, high_mm = PAPERS_MM[paper]
    par = board.params
    board_mm = (par.columns * par.square_mm, par.rows * par.square_mm)
    room_mm = (wide_mm - 2 * _EDGE_MM, high_mm - 2 * _EDGE_MM - _STRIP_MM)
    if board_mm[0] > room_mm[0] or board_mm[1] > room_mm[1]:
        raise SetupError(
            f"a board of {board_mm[0]:.0f} x {board_mm[1]:.0f} mm does not fit on {paper}, which "
            f"has room for {room_mm[0]:.0f} x {room_mm[1]:.0f} mm: take smaller or fewer squares"
        )
    sheet = np.full((round(high_mm * _PX_PER_MM), round(wide_mm * _PX_PER_MM)), 255, np.uint8)
    drawn = board.image(_PX_PER_MM)
    left = (sheet.shape[1] - drawn.shape[1]) // 2
    top = round((_EDGE_MM + (room_mm[1] - board_mm[1]) / 2) * _PX_PER_MM)
    sheet[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
    below = round((high_mm - _EDGE_MM - _STRIP_MM + 3.0) * _PX_PER_MM)
    # A line of 100 mm with a mark every 10 mm; the length is between the outer edges.
    mm = _PX_PER_MM
    sheet[below : below + 3, left : left + RULER_MM * mm] = _BLACK
    for at_mm in range(0, RULER_MM + 1, 10):
        high = (4 if at_mm % 50 == 0 else 2) * mm
        start = left + at_mm * mm - (3 if at_mm == RULER_MM else 0)
        sheet[below : below + high, start : start + 3] = _BLACK
    lines = (
        f"The line on the left is {RULER_MM} mm long: measure it.",
        "Print at 100 %, not 'fit to page'. Glue it on something flat and stiff.",
        f"ChArUco board {par.columns} x {par.rows}, squares {par.square_mm:g} mm, "
        f"markers {par.marker_mm:g} mm.",
    )
    for number, line in enumerate(lines):
        at = (left + (RULER_MM + 6) * mm, below + round((1.6 + 3.9 * number) * mm))
        cv2.putText(sheet, line, at, cv2.FONT_HERSHEY_SIMPLEX, 1.1, _BLACK, 3, cv2.LINE_8)
    return sheet


def write_page(board: CharucoBoard, paper: str, out: Path, force: bool = False) -> None:
    """Write the page as PDF or PNG, by the file's suffix; both print in true size.

    Raises:
        SetupError: see ``board_page``; or the suffix is another one, the file already exists and
            ``force`` is not set, or it cannot be written.
    """
    if out.suffix.lower() not in (".pdf", ".png"):
        raise SetupError(f"{out}: a page is written as .pdf or .png; choose such a name")
    image = Image.fromarray(board_page(board, paper))
    with output_file(out, force) as file:
        if out.suffix.lower() == ".pdf":
            # Lossless compression of two grey values: a JPEG inside would blur the corners.
            image = image.convert("1", dither=Image.Dither.NONE)
            image.save(file, format="PDF", resolution=_DPI)
        else:
            image.save(file, format="PNG", dpi=(_DPI, _DPI))

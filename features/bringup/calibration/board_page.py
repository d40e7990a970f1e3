"""The board on paper: a page in true size, with a ruler to check what the printer did."""

from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import output_file
from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.charuco_board import (
    COLUMNS,
    MARKER_MM,
    ROWS,
    SQUARE_MM,
    CharucoBoard,
)

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
    """Draw the page: (h, w) grey, 12 px per millimetre."""
    wide_mm, high_mm = PAPERS_MM[paper]
    board_high_mm, room_high_mm = ROWS * SQUARE_MM, high_mm - 2 * _EDGE_MM - _STRIP_MM
    sheet = np.full((round(high_mm * _PX_PER_MM), round(wide_mm * _PX_PER_MM)), 255, np.uint8)
    drawn = board.image(_PX_PER_MM)
    left = (sheet.shape[1] - drawn.shape[1]) // 2
    top = round((_EDGE_MM + (room_high_mm - board_high_mm) / 2) * _PX_PER_MM)
    sheet[top : top + drawn.shape[0], left : left + drawn.shape[1]] = drawn
    below = round((high_mm - _EDGE_MM - _STRIP_MM + 3.0) * _PX_PER_MM)
    # A line of 100 mm with a mark at each end; the length is between the outer edges.
    sheet[below : below + 3, left : left + RULER_MM * _PX_PER_MM] = _BLACK
    for start in (left, left + RULER_MM * _PX_PER_MM - 3):
        sheet[below : below + 4 * _PX_PER_MM, start : start + 3] = _BLACK
    lines = (
        f"The line on the left is {RULER_MM} mm long: measure it.",
        "Print at 100 %, not 'fit to page'. Glue it on something flat and stiff.",
        f"ChArUco board {COLUMNS} x {ROWS}, squares {SQUARE_MM:g} mm, markers {MARKER_MM:g} mm.",
    )
    for number, line in enumerate(lines):
        at = (left + (RULER_MM + 6) * _PX_PER_MM, below + round((1.6 + 3.9 * number) * _PX_PER_MM))
        cv2.putText(sheet, line, at, cv2.FONT_HERSHEY_SIMPLEX, 1.1, _BLACK, 3, cv2.LINE_8)
    return sheet


def write_page(board: CharucoBoard, paper: str, out: Path, force: bool = False) -> None:
    """Write the page as PDF or PNG, by the file's suffix; both print in true size.

    Raises:
        SetupError: the suffix is another one, the file already exists and ``force`` is not set,
            or it cannot be written.
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

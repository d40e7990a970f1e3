"""The calibration board: on paper in true size, and found in pictures."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.charuco_page import PAPERS_MM, RULER_MM, page, write_page
from gazerig.robot.model.charuco_board import BoardParams, CharucoBoard

BOARD = CharucoBoard()
PX_PER_MM = 12


@pytest.mark.parametrize("paper", sorted(PAPERS_MM))
def test_the_page_has_the_size_of_the_paper_in_print(paper: str, tmp_path: Path) -> None:
    wide_mm, high_mm = PAPERS_MM[paper]
    png, pdf = tmp_path / "board.png", tmp_path / "board.pdf"
    write_page(BOARD, paper, png)
    write_page(BOARD, paper, pdf)
    with Image.open(png) as image:
        dots_mm = [
            size / dpi * 25.4 for size, dpi in zip(image.size, image.info["dpi"], strict=True)
        ]
    assert dots_mm == pytest.approx((wide_mm, high_mm), abs=0.1)
    box = re.search(rb"/MediaBox \[ ([\d. ]+) \]", pdf.read_bytes())
    assert box is not None
    left, low, right, top = map(float, box.group(1).split())
    assert ((right - left) / 72 * 25.4, (top - low) / 72 * 25.4) == pytest.approx(
        (wide_mm, high_mm), abs=0.1
    )


@pytest.mark.parametrize("paper", sorted(PAPERS_MM))
def test_squares_and_ruler_on_the_page_are_as_long_as_they_say(paper: str) -> None:
    sheet = page(BOARD, paper)
    seen = BOARD.find(cv2.GaussianBlur(sheet, (0, 0), 2.0).astype(np.uint8))
    assert seen is not None and len(seen.ids) == 24
    sides = np.diff(seen.corners_px.reshape(4, 6, 2)[:, :, 0], axis=1) / PX_PER_MM
    assert sides == pytest.approx(np.full((4, 5), 36.0), abs=0.02)
    below = sheet[int(seen.corners_px[:, 1].max()) + round(37.0 * PX_PER_MM) :]
    longest = max(_runs(row == 0) for row in below)
    assert longest == RULER_MM * PX_PER_MM


def _runs(dark: np.ndarray) -> int:
    """Return the longest run of dark pixels."""
    ends = np.flatnonzero(np.diff(np.concatenate(([0], dark.astype(int), [0]))))
    return int(np.max(ends[1::2] - ends[::2], initial=0))


def test_the_pdf_holds_the_page_unblurred(tmp_path: Path) -> None:
    write_page(BOARD, "a4", tmp_path / "board.pdf")
    assert b"/CCITTFaxDecode" in (tmp_path / "board.pdf").read_bytes()


@pytest.mark.parametrize(
    ("board", "paper", "name", "message"),
    [
        (BOARD, "a5", "b.pdf", "unknown; there is a4, letter"),
        (BOARD, "a4", "b.jpg", "written as .pdf or .png"),
        (CharucoBoard(BoardParams(7, 5, 50.0, 38.0)), "a4", "b.pdf", "does not fit on a4"),
    ],
)
def test_pages_that_cannot_be_are_refused(
    board: CharucoBoard, paper: str, name: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(SetupError, match=message):
        write_page(board, paper, tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("measures", "message"),
    [((7, 5, 36.0, 35.0), "0.4 to 0.9"), ((20, 20, 10.0, 7.0), "more than 50 markers")],
)
def test_boards_that_cannot_be_are_refused(
    measures: tuple[int, int, float, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        BoardParams(*measures)


def test_a_printer_that_shrinks_is_reckoned_with() -> None:
    printed = BoardParams().scaled(0.97)
    assert (printed.square_mm, printed.marker_mm) == pytest.approx((34.92, 26.19))
    with pytest.raises(ValueError, match="0.2 to 5"):
        BoardParams().scaled(0.0)


def test_a_board_half_out_of_the_picture_is_known_by_its_corners() -> None:
    picture = cv2.copyMakeBorder(BOARD.image(2.0), 20, 20, 20, 20, cv2.BORDER_CONSTANT, value=255)
    seen = BOARD.find(np.ascontiguousarray(picture[:, : picture.shape[1] // 2 + 40]))
    assert seen is not None and 6 <= len(seen.ids) < 24
    assert seen.corners_px == pytest.approx(seen.corners_board_m[:, :2] * 2000.0 + 19.5, abs=0.1)


def test_one_row_of_corners_is_no_view() -> None:
    picture = cv2.copyMakeBorder(BOARD.image(2.0), 20, 20, 20, 20, cv2.BORDER_CONSTANT, value=255)
    assert BOARD.find(np.ascontiguousarray(picture[: 20 + 72 + 60])) is None


@pytest.mark.parametrize(
    "shape", [(1, 1), (1, 1, 3), (200, 300), (200, 300, 1), (200, 300, 3), (200, 300, 4), (9, 9, 2)]
)
def test_pictures_without_a_board_hold_none(shape: tuple[int, ...]) -> None:
    noise = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    assert BOARD.find(noise) is None
    assert BOARD.find(np.zeros(shape, np.uint8)) is None


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_grey_colour_and_alpha_are_all_understood(channels: int) -> None:
    grey = cv2.copyMakeBorder(BOARD.image(2.0), 20, 20, 20, 20, cv2.BORDER_CONSTANT, value=255)
    seen = BOARD.find(np.repeat(grey[:, :, None], channels, axis=2))
    assert seen is not None and len(seen.ids) == 24

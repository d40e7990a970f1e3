"""The heat map of gaze on a face: measures, shares, colours and what it refuses."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from gazerig.drivers.errors import SetupError
from gazerig.gaze.types import PARTS
from gazerig.robot.analysis.heatmap import (
    HEIGHT_PX,
    PX_PER_M,
    WIDTH_PX,
    align_face,
    canvas_pixels,
    density_s_m2,
    draw_face,
    share_per_part,
    write_heatmap,
)
from gazerig.robot.model.face_geometry import PARTS_FACE_M

MEDIA = Path(__file__).parents[2] / "shared" / "media"
CENTRES = np.array([PARTS_FACE_M[part][1:] for part in PARTS])


def shown(out: Path) -> np.ndarray:
    picture = cv2.imread(str(out))
    assert picture is not None
    return picture


def colour_at(picture: np.ndarray, part: str) -> tuple[int, int, int]:
    column, row = np.rint(canvas_pixels(np.array([PARTS_FACE_M[part][1:]]))[0]).astype(int)
    blue, green, red = picture[row, column].tolist()
    return red, green, blue


def test_shares_are_of_time_and_by_the_nearest_part() -> None:
    points = [*CENTRES, (0.15, 0.0), CENTRES[2] + (0.004, -0.003)]
    seconds = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 4.0, 10.0]
    shares = share_per_part(points, seconds)
    assert sum(shares.values()) == pytest.approx(1.0)
    wanted = dict(zip(PARTS, seconds, strict=False))
    wanted["LE"] += 10.0
    for part in PARTS:
        assert shares[part] == pytest.approx(wanted[part] / 50.0), part
    assert shares["elsewhere"] == pytest.approx(4.0 / 50.0)


def test_density_keeps_the_time_and_lies_where_it_was_looked() -> None:
    eye = np.array([PARTS_FACE_M["RE"][1:], PARTS_FACE_M["RE"][1:]])
    density = density_s_m2(eye, np.array([1.0, 2.5]))
    assert density.shape == (HEIGHT_PX, WIDTH_PX)
    assert density.sum() / PX_PER_M**2 == pytest.approx(3.5, rel=1e-6)
    row, column = np.unravel_index(density.argmax(), density.shape)
    assert (column, row) == pytest.approx(tuple(canvas_pixels(eye)[0]), abs=1.0)
    assert column < WIDTH_PX / 2  # the owner's right is at the left of who faces them


def test_yellow_is_where_the_gaze_was_longest(tmp_path: Path) -> None:
    out = tmp_path / "map.png"
    seconds = np.full(8, 1.0)
    seconds[PARTS.index("N")], seconds[PARTS.index("UP")] = 10.0, 0.01
    shares = write_heatmap(CENTRES, seconds, out)
    picture = shown(out)
    red, green, blue = colour_at(picture, "N")
    assert red > 200 and green > 190 and blue < 90
    red, green, blue = colour_at(picture, "M")
    assert blue > green + 30  # purple
    plain, column_row = draw_face(), np.rint(canvas_pixels(CENTRES)).astype(int)
    column, row = column_row[PARTS.index("UP")]
    assert (picture[row, column] == plain[row, column]).all()  # as good as never looked at
    assert picture.shape[0] == HEIGHT_PX and picture.shape[1] > WIDTH_PX
    assert shares["N"] == pytest.approx(10.0 / seconds.sum())


def test_the_drawn_face_has_its_pupils_where_they_are_looked_for() -> None:
    face = draw_face().astype(int).sum(axis=2)
    for part in ("LE", "RE"):
        column, row = np.rint(canvas_pixels(CENTRES[[PARTS.index(part)]])[0]).astype(int)
        around = face[row - 60 : row + 61, column - 60 : column + 61]
        dark_rows, dark_columns = np.nonzero(around < 260)
        assert dark_rows.mean() == pytest.approx(60.0, abs=4.0), part
        assert dark_columns.mean() == pytest.approx(60.0, abs=4.0), part


def test_a_photograph_is_brought_to_the_same_measures(tmp_path: Path) -> None:
    photograph = MEDIA / "astronaut.png"
    if not photograph.is_file():
        pytest.skip(f"{photograph} is not there")
    canvas = align_face(photograph)
    assert canvas.shape == (HEIGHT_PX, WIDTH_PX, 3)
    for part in ("LE", "RE"):  # pupils are darker than the cheek below them
        column, row = np.rint(canvas_pixels(CENTRES[[PARTS.index(part)]])[0]).astype(int)
        eye = canvas[row - 20 : row + 21, column - 20 : column + 21, 0]
        cheek = canvas[row + 90 : row + 130, column - 20 : column + 21, 0]
        assert int(eye.min()) + 60 < float(np.median(cheek)), part
    write_heatmap(CENTRES, np.ones(8), tmp_path / "map.png", photograph)
    assert shown(tmp_path / "map.png").shape[0] == HEIGHT_PX


def test_what_cannot_be_mapped_is_refused(tmp_path: Path) -> None:
    out, blank = tmp_path / "map.png", tmp_path / "blank.png"
    with pytest.raises(ValueError, match="never on a face"):
        write_heatmap(np.zeros((0, 2)), [], out)
    with pytest.raises(ValueError, match=r"wanted \(n, 2\) points"):
        write_heatmap([(0.0, 0.0, 0.0)], [1.0], out)
    with pytest.raises(ValueError, match="no time below 0"):
        write_heatmap([(0.0, 0.0), (0.0, 0.0)], [1.0, -0.5], out)
    with pytest.raises(ValueError, match="finite"):
        write_heatmap([(0.0, float("nan"))], [1.0], out)
    with pytest.raises(SetupError, match="is no image that can be read"):
        write_heatmap(CENTRES, np.ones(8), out, tmp_path / "absent.png")
    cv2.imwrite(str(blank), np.full((200, 200, 3), 128, np.uint8))
    with pytest.raises(SetupError, match="no face found"):
        write_heatmap(CENTRES, np.ones(8), out, blank)
    with pytest.raises(SetupError, match="name another file"):
        write_heatmap(CENTRES, np.ones(8), tmp_path / "nowhere" / "map.png")
    assert not out.exists()

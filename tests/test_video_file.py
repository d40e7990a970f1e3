"""Films and stills give the right picture at the right film time, and report errors."""

import os
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from fakes.films import write_film

from gazerig.drivers.camera.video_file import VideoFile, usable_rate_hz
from gazerig.drivers.errors import CameraError

LENGTH, RATE_HZ = 20, 10.0


@pytest.fixture(scope="module")
def film_file(tmp_path_factory) -> Path:
    return write_film(tmp_path_factory.mktemp("films") / "film.avi", LENGTH, RATE_HZ, grey=10)


@pytest.fixture
def film(film_file):
    video = VideoFile(film_file)
    video.open()
    yield video
    video.close()


def shade(picture: np.ndarray) -> int:
    """Return the number of the film's picture, from 0."""
    return round(float(picture.mean()) / 10)


def test_picture_at_is_the_newest_due(film):
    for film_s, number in ((0.0, 1), (0.05, 1), (0.1, 2), (0.1999, 2), (0.2, 3), (1.95, 20)):
        seen = film.frame_at(film_s)
        assert seen.number == number
        assert seen.film_time_s == pytest.approx((number - 1) / RATE_HZ)
        assert shade(seen.image) == number - 1


def test_film_repeats_and_counts_on(film):
    numbers = [1, 20, 21, 25, 40, 41, 65]
    assert [shade(film.image(n)) for n in numbers] == [(n - 1) % LENGTH for n in numbers]
    assert film.due_s(41) == pytest.approx(4.0)


def test_long_jump_lands_on_the_right_picture(film):
    film.image(3)
    for number in (1_000_007, 1_000_008, 30_000_000_020):
        assert shade(film.image(number)) == (number - 1) % LENGTH


def test_closed_film_says_so(film):
    film.close()
    film.close()
    with pytest.raises(CameraError, match="not open"):
        film.image(1)


def test_still_repeats_ten_times_a_second(tmp_path):
    file = tmp_path / "still.png"
    cv2.imwrite(str(file), np.full((30, 40, 3), (10, 100, 200), np.uint8))
    video = VideoFile(str(file))
    video.open()
    early, late = video.frame_at(0.05), video.frame_at(100.0)
    assert (early.number, late.number) == (1, 1001)
    assert late.image is early.image and early.image[5, 5].tolist() == [10, 100, 200]
    with pytest.raises(ValueError, match="forward"):
        video.frame_at(50.0)


def test_name_with_a_pattern_in_it_is_one_file(tmp_path):
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"still_{k:02d}.png"), np.full((30, 40, 3), 50 * k, np.uint8))
    video = VideoFile(tmp_path / "still_01.png")
    video.open()
    assert [int(video.image(n)[0, 0, 0]) for n in (1, 2, 3)] == [50, 50, 50]


def test_rate_that_is_none_is_replaced_and_noted():
    assert usable_rate_hz(23.976) == (23.976, "")
    for stated in (0.0, -1.0, float("nan"), float("inf"), 90000.0):
        rate_hz, note = usable_rate_hz(stated)
        assert rate_hz == 25.0
        assert "25 assumed" in note


# ---- what is wrong with the file --------------------------------------------------------


def refusal(path: Path) -> str:
    video = VideoFile(path)
    with pytest.raises(CameraError) as caught:
        video.open()
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


def test_absent_file(tmp_path):
    assert "check the path" in refusal(tmp_path / "none.avi")


def test_directory(tmp_path):
    assert "is not a file" in refusal(tmp_path)


@pytest.mark.parametrize(("name", "content"), [("x.avi", b""), ("x1.png", b"some text\n")])
def test_file_that_is_no_film(tmp_path, content, name):
    (tmp_path / name).write_bytes(content)
    assert "readable" in refusal(tmp_path / name)


def test_film_cut_short(tmp_path, film_file):
    content = film_file.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: int(0.7 * len(content))])
    assert "cut short" in refusal(tmp_path / "cut.avi")


def test_picture_cut_short(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (60, 60, 3), np.uint8)
    content = cv2.imencode(".png", noise)[1].tobytes()
    (tmp_path / "cut.png").write_bytes(content[:40])
    assert "damaged" in refusal(tmp_path / "cut.png")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_file_without_rights(film_file, tmp_path):
    (tmp_path / "secret.avi").write_bytes(film_file.read_bytes())
    (tmp_path / "secret.avi").chmod(0)
    assert "check its permissions" in refusal(tmp_path / "secret.avi")


# ---- real time --------------------------------------------------------------------------


class Hand:
    """A clock moved by hand."""

    def __init__(self, t_s: float) -> None:
        self.t_s = t_s

    def __call__(self) -> float:
        return self.t_s


def test_take_gives_each_picture_at_its_due_time(film):
    clock, go_on = Hand(100.0), threading.Event()
    first = film.take(clock, go_on)
    assert (first.captured_s, first.number, shade(first.image)) == (100.0, 1, 0)
    clock.t_s = 100.1
    second = film.take(clock, go_on)
    assert second.captured_s == pytest.approx(100.1)
    assert (second.number, shade(second.image)) == (2, 1)


def test_take_skips_what_came_while_nobody_looked(film):
    clock, go_on = Hand(0.0), threading.Event()
    film.take(clock, go_on)
    clock.t_s = 0.75
    late = film.take(clock, go_on)
    assert (late.number, shade(late.image)) == (8, 7)
    assert late.captured_s == pytest.approx(0.7)


def test_take_ends_when_told_to_stop(film):
    stop = threading.Event()
    stop.set()
    assert film.take(Hand(0.0), stop) is None

"""Films and stills give the right picture at the right film time, and report errors."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from fakes.films import write_film

from gazerig.drivers.camera.video_file import VideoFile, usable_rate_hz
from gazerig.drivers.errors import CameraError

SHARED = Path(__file__).parents[2] / "shared"
FILM_FILE = SHARED / "media" / "Megamind.avi"
needs_film = pytest.mark.skipif(not FILM_FILE.exists(), reason=f"no {FILM_FILE}")

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


def test_film_states_its_rate(film):
    assert film.rate_hz == RATE_HZ
    assert film.note == ""


def test_picture_at_is_the_newest_due(film):
    for film_s, number in ((0.0, 1), (0.05, 1), (0.1, 2), (0.1999, 2), (0.2, 3), (1.95, 20)):
        seen = film.frame_at(film_s)
        assert seen.number == number
        assert seen.film_time_s == pytest.approx((number - 1) / RATE_HZ)
        assert shade(seen.image) == number - 1


def test_every_due_time_belongs_to_its_own_picture(tmp_path):
    video = VideoFile(write_film(tmp_path / "odd.avi", 3, 23.976))
    video.open()
    assert all(video.number_at(video.due_s(number)) == number for number in range(1, 5000))
    assert video.number_at(-0.001) == 0


def test_film_repeats_and_counts_on(film):
    numbers = [1, 20, 21, 25, 40, 41, 65]
    assert [shade(film.image(n)) for n in numbers] == [(n - 1) % LENGTH for n in numbers]
    assert film.due_s(41) == pytest.approx(4.0)


def test_long_jump_lands_on_the_right_picture(film):
    film.image(3)
    for number in (1_000_007, 1_000_008, 30_000_000_020):
        assert shade(film.image(number)) == (number - 1) % LENGTH


def test_same_picture_may_be_asked_for_again_but_none_before(film):
    first = film.frame_at(0.5)
    assert film.frame_at(0.55).image is first.image
    with pytest.raises(ValueError, match="forward"):
        film.frame_at(0.3)


@pytest.mark.parametrize("film_s", [-0.1, -5.0])
def test_film_time_starts_at_zero(film, film_s):
    with pytest.raises(ValueError, match="frame -?[0-9]+ requested"):
        film.frame_at(film_s)


def test_open_starts_anew(film):
    film.image(15)
    film.open()
    assert shade(film.image(1)) == 0


def test_pictures_are_colour_and_read_only(film):
    picture = film.image(1)
    assert picture.shape == (48, 64, 3)
    assert picture.dtype == np.uint8
    with pytest.raises(ValueError, match="read-only"):
        picture[0, 0, 0] = 1


def test_closed_film_says_so(film):
    film.close()
    film.close()
    with pytest.raises(CameraError, match="not open"):
        film.image(1)


@pytest.mark.parametrize("ending", ["png", "jpg"])
def test_still_repeats_ten_times_a_second(tmp_path, ending):
    file = tmp_path / f"still.{ending}"
    cv2.imwrite(str(file), np.full((30, 40, 3), (10, 100, 200), np.uint8))
    video = VideoFile(str(file))
    video.open()
    assert video.rate_hz == 10.0
    early, late = video.frame_at(0.05), video.frame_at(100.0)
    assert (early.number, late.number) == (1, 1001)
    assert late.image is early.image
    assert np.abs(early.image[5, 5].astype(int) - (10, 100, 200)).max() < 5
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


@pytest.mark.parametrize("content", [b"", b"some text\n", bytes(range(256)) * 20])
@pytest.mark.parametrize("name", ["x.avi", "x.txt", "x1.png"])
def test_file_that_is_no_film(tmp_path, content, name):
    (tmp_path / name).write_bytes(content)
    assert "readable" in refusal(tmp_path / name)


def test_reader_is_silent_beside_the_error(tmp_path, film_file):
    content = film_file.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: len(content) // 2])
    (tmp_path / "x.mp4").write_bytes(bytes(4) + b"ftypisom" + bytes(500))
    code = (
        "import sys; from gazerig.drivers.errors import CameraError\n"
        "from gazerig.drivers.camera.video_file import *\n"
        "for path in sys.argv[1:]:\n"
        "    try: VideoFile(path).open()\n"
        "    except CameraError as error: print(error)\n"
    )
    files = [str(tmp_path / "cut.avi"), str(tmp_path / "x.mp4")]
    done = subprocess.run([sys.executable, "-c", code, *files], capture_output=True, text=True)
    assert (len(done.stdout.splitlines()), done.stderr) == (2, "")


def test_film_without_pictures(tmp_path):
    assert refusal(write_film(tmp_path / "empty.avi", 0))


@pytest.mark.parametrize("part", [0.5, 0.7, 0.85])
def test_film_cut_short(tmp_path, film_file, part):
    content = film_file.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: int(part * len(content))])
    assert "cut short" in refusal(tmp_path / "cut.avi")


def test_film_cut_to_its_header(tmp_path, film_file):
    (tmp_path / "cut.avi").write_bytes(film_file.read_bytes()[:1000])
    assert "not a readable film or image" in refusal(tmp_path / "cut.avi")


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


def test_film_that_vanishes_is_noticed_at_its_end(tmp_path):
    file = write_film(tmp_path / "film.avi", 4, RATE_HZ, grey=10)
    video = VideoFile(file)
    video.open()
    file.unlink()
    assert shade(video.image(4)) == 3
    with pytest.raises(CameraError, match=r"film\.avi"):
        video.image(5)


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


def test_take_waits_for_the_next_picture_and_never_repeats_one(film):
    clock, go_on = Hand(0.0), threading.Event()
    numbers = [film.take(clock, go_on).number for _ in range(3)]
    assert numbers == [1, 2, 3]


def test_take_ends_when_told_to_stop(film):
    stop = threading.Event()
    stop.set()
    assert film.take(Hand(0.0), stop) is None


@needs_film
def test_real_film_is_read_to_its_end():
    video = VideoFile(FILM_FILE)
    video.open()
    assert video.rate_hz == pytest.approx(23.976)
    first = video.image(1)
    assert first.shape == (528, 720, 3)
    assert np.array_equal(video.image(271), first)
    assert video.due_s(271) == pytest.approx(11.261, abs=0.001)


@needs_film
def test_real_film_cut_short_is_refused(tmp_path):
    content = FILM_FILE.read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: len(content) // 2])
    assert "cut short after 1" in refusal(tmp_path / "cut.avi")

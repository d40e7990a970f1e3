"""Films play by the times and rotation of their containers; a wrong file gets one clear error."""

import threading
from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from fakes.films import write_film

from gazerig.drivers.camera.film import Film
from gazerig.drivers.errors import CameraError

LENGTH, RATE_HZ = 20, 10.0
GO_ON = threading.Event()


def film_of(
    path: Path, times_s: Sequence[float], codec: str = "mpeg4", rotation: int = 0
) -> list[float]:
    """Write a film whose picture k is due at a time, and return the container's times."""
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=1000)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000 if path.suffix == ".webm" else 1200)
        if path.suffix == ".webm":
            stream.codec_context.framerate = 0  # the container states no rate
        if rotation:
            stream.set_display_rotation(rotation)
        for k, time_s in enumerate(times_s):
            image = np.full((48, 64, 3), 5 * k % 256, np.uint8)
            image[:12, :16] = 0, 0, 255
            picture = av.VideoFrame.from_ndarray(image, format="bgr24")
            picture.time_base = stream.codec_context.time_base
            picture.pts = round(time_s / picture.time_base)
            container.mux(stream.encode(picture))
        container.mux(stream.encode())
    with av.open(str(path)) as found:
        return [float(p.pts * p.time_base) for p in found.demux(video=0) if p.pts is not None]


def steps(*parts: tuple[int, float]) -> list[float]:
    """Return times with numbers of equal steps."""
    return [0.0, *accumulate(step_s for count, step_s in parts for _ in range(count))]


@pytest.mark.parametrize(
    ("name", "times_s"),
    [
        *((f"{rate}.mp4", steps((rate, 1.0 / rate))) for rate in (10, 24, 50, 120, 240)),
        ("pause.mp4", steps((30, 1.0 / 30.0), (1, 3.0), (30, 1.0 / 30.0))),
        ("slower.mp4", steps((100, 1.0 / 30.0), (100, 0.1))),
        ("no-rate.webm", steps((20, 0.066), (20, 0.041), (20, 0.1))),
    ],
)
def test_each_picture_is_due_at_its_time_in_the_container(tmp_path, name, times_s):
    codec = "libvpx" if name.endswith("webm") else "mpeg4"
    container_s = sorted(film_of(tmp_path / name, times_s, codec))
    film = Film(tmp_path / name)
    film.open()
    for due_s, time_s in zip(container_s, times_s, strict=True):
        assert film.next_shot().captured_s == pytest.approx(due_s, abs=1e-6)
        assert due_s == pytest.approx(time_s, abs=0.002)
    assert times_s[-1] < film.due_s < times_s[-1] + 0.15  # it begins again
    assert film.events() == ()
    film.close()


@pytest.mark.parametrize("rotation", [0, 90, 180, -90])
def test_a_film_is_turned_as_its_container_says(tmp_path, rotation):
    film_of(tmp_path / "turned.mp4", steps((3, 0.1)), rotation=rotation)
    film = Film(tmp_path / "turned.mp4")
    film.open()
    image = film.next_shot().image
    assert image.shape == ((48, 64, 3) if rotation % 180 == 0 else (64, 48, 3))
    corners = image[3, 4], image[3, -5], image[-4, -5], image[-4, 4]
    red = [int(corner[2]) - int(corner[1]) > 100 for corner in corners]  # clockwise from upper left
    assert red.index(True) == -rotation // 90 % 4 and sum(red) == 1


@pytest.fixture(scope="module")
def film_file(tmp_path_factory) -> Path:
    return write_film(tmp_path_factory.mktemp("films") / "film.avi", LENGTH, RATE_HZ, grey=10)


def shade(picture: np.ndarray) -> int:
    """Return the number of the film's picture, from 0."""
    return round(float(picture.mean()) / 10)


# ---- what is wrong with the file --------------------------------------------------------


def refusal(path: Path) -> str:
    with pytest.raises(CameraError) as caught:
        Film(path).open()
    message = str(caught.value)
    assert "\n" not in message and str(path) in message
    return message


def test_absent_file_and_directory(tmp_path):
    assert "check the path" in refusal(tmp_path / "none.avi")
    assert "is a directory" in refusal(tmp_path)


@pytest.mark.parametrize(("name", "content"), [("x.avi", b""), ("x1.png", b"some text\n")])
def test_file_that_is_no_film(tmp_path, content, name):
    (tmp_path / name).write_bytes(content)
    assert "readable" in refusal(tmp_path / name)


@pytest.mark.parametrize("name", ["cut.avi", "cut.webm", "cut.mp4"])
def test_film_cut_short(tmp_path, film_file, name):
    content = film_file.read_bytes()
    if name != "cut.avi":
        film_of(tmp_path / name, steps((100, 0.04)), "libvpx" if "webm" in name else "mpeg4")
        content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: int(0.7 * len(content))])
    assert "cut short" in refusal(tmp_path / name)


def test_damaged_pictures_are_skipped_and_told_once(tmp_path):
    file = tmp_path / "scratched.mp4"
    film_of(file, steps((100, 0.04)), "libx264")
    content = bytearray(file.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 400] = b"\xa5" * 400
    file.write_bytes(content)
    film = Film(file)
    film.open()
    for _ in range(150):
        film.next_shot()
    (line,) = film.events()
    assert "damaged" in line and "skipped" in line


# ---- real time --------------------------------------------------------------------------


def test_take_gives_the_newest_due_picture_at_its_time(film_file):
    film, now = Film(film_file), [100.0]
    film.open()
    for now_s, due_s, number in ((100.0, 100.0, 1), (100.1, 100.1, 2), (100.85, 100.8, 9)):
        now[0] = now_s
        shot = film.take(lambda: now[0], GO_ON)
        assert shot is not None
        assert (shot.number, shade(shot.image)) == (number, number - 1)
        assert shot.captured_s == pytest.approx(due_s)
    now[0] = 4000.0  # the computer was suspended: the film goes on where it was
    shot = film.take(lambda: now[0], GO_ON)
    assert shot is not None and (shot.number, shot.captured_s) == (10, 4000.0)
    stop = threading.Event()
    stop.set()
    assert film.take(lambda: now[0], stop) is None

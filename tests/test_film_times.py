"""Films whose pictures come unevenly, or at another rate than stated, run by their own times."""

import cv2
import numpy as np
import pytest
from fakes.films import write_film
from hypothesis import given
from hypothesis import strategies as st
from present import present

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.video_file import (
    VideoFile,
    VideoTimestamps,
    ascending_times,
    timestamps_from_rate,
    timestamps_from_times,
)
from gazerig.drivers.errors import CameraError
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams

UNEVEN = (0, 1, 2, 6, 7, 8, 12, 13, 14, 20, 21, 22, 23, 30, 31, 32, 40, 41, 42, 43)


def retimed(source, path, ticks, rate_hz=30.0):
    """Pack the pictures of a film again, picture k at ticks[k] / rate_hz."""
    packets = cv2.VideoCapture(str(source), cv2.CAP_FFMPEG, [cv2.CAP_PROP_FORMAT, -1])
    writer = cv2.VideoWriter(
        str(path),
        cv2.CAP_FFMPEG,
        cv2.VideoWriter.fourcc(*"mp4v"),
        rate_hz,
        (64, 48),
        [cv2.VIDEOWRITER_PROP_RAW_VIDEO, 1],
    )
    for tick in ticks:
        found, packet = packets.read()
        assert found
        writer.set(cv2.VIDEOWRITER_PROP_PTS, tick)
        writer.write(packet)
    writer.release()
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("times")
    write_film(folder / "plain.mp4", 20, 30.0, grey=12, fourcc="mp4v")
    return folder


def opened(path) -> VideoFile:
    film = VideoFile(path)
    film.open()
    return film


def test_uneven_film_runs_by_the_times_of_its_pictures(folder):
    film = opened(retimed(folder / "plain.mp4", folder / "uneven.mkv", UNEVEN))
    for k, tick in enumerate(UNEVEN):
        assert film.due_s(k + 1) == pytest.approx(tick / 30.0, abs=0.002)
        assert film.number_at(film.due_s(k + 1)) == k + 1
        assert round(float(film.image(k + 1).mean()) / 12.0) == k
    (reported,) = film.events()
    assert reported.startswith("uneven.mkv: the film's frames are unevenly spaced")
    assert film.events() == ()
    # The last picture stays for the usual time; then the film starts again.
    assert film.due_s(21) == pytest.approx(44 / 30.0, abs=0.003)
    assert round(float(film.image(21).mean()) / 12.0) == 0


def test_film_that_lies_about_its_rate_is_noticed(folder):
    film = opened(retimed(folder / "plain.mp4", folder / "slow.mkv", range(0, 40, 2)))
    assert film.rate_hz == pytest.approx(15.0, rel=0.01)
    assert film.due_s(11) == pytest.approx(10 / 15.0, rel=0.01)
    assert "states 30 frames a second and shows 15" in film.note


def test_honest_film_is_left_alone(folder):
    film = opened(folder / "plain.mp4")
    assert (film.rate_hz, film.note, film.events()) == (30.0, "", ())
    assert film.due_s(7) == 6 / 30.0


def times_s(rate_hz, count=40):
    return [k / rate_hz for k in range(count)]


def test_stated_rate_is_judged_by_the_times():
    assert timestamps_from_rate(25.0, "", times_s(25.0)) == VideoTimestamps(25.0)
    assert present(timestamps_from_rate(25.0, "", times_s(25.1))).rate_hz == 25.0  # rounding
    lie = timestamps_from_rate(25.0, "", times_s(12.5))
    assert present(lie).rate_hz == pytest.approx(12.5)
    assert "states 25 frames a second and shows 12.5" in present(lie).note
    assert timestamps_from_rate(25.0, "", [tick / 25.0 for tick in UNEVEN]) is None
    assert present(
        timestamps_from_rate(25.0, "25 assumed", times_s(10.0))
    ).rate_hz == pytest.approx(10.0)
    assert present(timestamps_from_rate(25.0, "25 assumed", [])).note == "25 assumed"


def test_times_that_are_missing_are_put_right():
    assert ascending_times([0.0, 0.1, 0.2, 0.0]) == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert ascending_times([0.0] * 10) == []
    assert ascending_times([]) == []


@given(st.lists(st.floats(0.001, 2.0), min_size=2, max_size=30), st.integers(1, 200))
def test_every_due_time_belongs_to_its_own_picture(steps, number):
    times = timestamps_from_times(np.cumsum([5.0, *steps]).tolist())
    assert times.number_at(times.due_s(number)) == number
    assert times.due_s(number + 1) > times.due_s(number)
    assert times.number_at(-0.001) <= 0


class NoFaces:
    def find(self, picture):
        assert picture.ndim == 3 and picture.shape[2] == 3
        return ()


@pytest.mark.parametrize(
    "pixels",
    [
        np.full((1, 1, 3), 9, np.uint8),
        np.full((40, 30), 9, np.uint8),
        np.full((40, 30, 4), 9, np.uint8),
        np.full((40, 30, 3), 9 << 8, np.uint16),
        np.full((1, 3000, 3), 9, np.uint8),
    ],
    ids=["1x1", "grey", "alpha", "16 bits", "thin"],
)
def test_odd_stills_become_plain_pictures(tmp_path, pixels):
    file = tmp_path / "odd.png"
    cv2.imwrite(str(file), pixels)
    for detector in (NoFaces(), face_detector(FaceDetectorParams())):
        film = opened(file)
        found = FrameAnalyzer(detector).analyze(film.shot(1))
        assert found.faces == ()
        assert (found.height_px, found.width_px) == pixels.shape[:2]
        assert (
            present(found.image).shape == (*pixels.shape[:2], 3)
            and present(found.image).dtype == np.uint8
        )


def test_picture_beyond_all_memory_is_named(tmp_path):
    file = tmp_path / "huge.bmp"
    # A header that promises 60000 x 60000 pixels, and none of them.
    header = b"BM" + (10_800_000_054).to_bytes(8, "little")[:4] + bytes(4)
    header += (54).to_bytes(4, "little") + (40).to_bytes(4, "little")
    header += (60_000).to_bytes(4, "little") * 2 + b"\x01\x00\x18\x00" + bytes(24)
    file.write_bytes(header)
    with pytest.raises(CameraError, match="too large an image|damaged image"):
        VideoFile(file).open()


def test_small_film_of_grey_is_a_film(tmp_path):
    writer = cv2.VideoWriter(
        str(tmp_path / "g.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (16, 16), isColor=False
    )
    for k in range(12):
        writer.write(np.full((16, 16), 20 * k, np.uint8))
    writer.release()
    assert opened(tmp_path / "g.avi").image(1).shape == (16, 16, 3)


def test_empty_file_and_file_of_text_are_named(tmp_path):
    for name, content in (("a.avi", b""), ("b.mp4", b"this is no film"), ("c.png", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(CameraError, match="is not a readable film or image|damaged image"):
            VideoFile(tmp_path / name).open()
    with pytest.raises(CameraError, match="is not a file"):
        VideoFile(tmp_path).open()
    with pytest.raises(CameraError, match="no film or image at"):
        VideoFile(tmp_path / "nope.avi").open()

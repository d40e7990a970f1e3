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


@pytest.mark.parametrize(
    "pixels",
    [
        np.full((1, 1, 3), 9, np.uint8),
        np.full((40, 30, 4), 9, np.uint8),
        np.full((40, 30), 9 << 8, np.uint16),
    ],
    ids=["1x1", "alpha", "grey of 16 bits"],
)
def test_odd_stills_become_plain_pictures(tmp_path, pixels):
    file = tmp_path / "odd.png"
    cv2.imwrite(str(file), pixels)
    found = FrameAnalyzer(face_detector(FaceDetectorParams())).analyze(opened(file).shot(1))
    assert found.faces == () and (found.height_px, found.width_px) == pixels.shape[:2]
    image = present(found.image)
    assert image.shape == (*pixels.shape[:2], 3) and image.dtype == np.uint8

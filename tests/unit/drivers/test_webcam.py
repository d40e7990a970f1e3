"""A camera that is absent, forbidden or silent is named; pictures carry their own times."""

import os
import threading

import cv2
import numpy as np
import pytest
from present import present
from stand_in import Capture

from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.camera.webcam import Webcam
from gazerig.drivers.errors import CameraError

GO_ON = threading.Event()


@pytest.fixture
def device(tmp_path):
    """A file in the place of a device file."""
    file = tmp_path / "video0"
    file.touch()
    return file


def opened(device, capture: Capture, latency_ms: float = 0.0) -> Webcam:
    camera = Webcam(device, WebcamParams(800, 600, 25.0, latency_ms), lambda name: capture)
    camera.open()
    return camera


def test_absent_camera_is_named_with_what_there_is(tmp_path, device):
    with pytest.raises(CameraError, match=r"no camera at .*video7 \(found: .*video0\)"):
        Webcam(tmp_path / "video7").open()
    device.unlink()
    with pytest.raises(CameraError, match="found: none"):
        Webcam(tmp_path / "video7").open()


def test_file_that_is_no_camera_is_refused_quietly(device, capfd):
    with pytest.raises(CameraError, match="delivers no frame") as caught:
        Webcam(device).open()
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open everything")
def test_camera_without_rights_names_the_group(device):
    device.chmod(0)
    with pytest.raises(CameraError, match="group video"):
        Webcam(device).open()


def test_camera_that_gives_nothing_is_refused_and_freed(device):
    silent = Capture(works=False)
    with pytest.raises(CameraError, match="another program uses it"):
        opened(device, silent)
    assert silent.released


@pytest.fixture
def capture():
    return Capture()


def test_wishes_reach_the_camera_the_compressed_format_first(capture, device):
    opened(device, capture)
    assert list(capture.wishes.items()) == [  # sizes depend on the format
        (cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG")),
        (cv2.CAP_PROP_FRAME_WIDTH, 800),
        (cv2.CAP_PROP_FRAME_HEIGHT, 600),
        (cv2.CAP_PROP_FPS, 25.0),
        (cv2.CAP_PROP_BUFFERSIZE, 1),
    ]


@pytest.mark.parametrize(
    ("stamp_ms", "latency_ms", "captured_s"),
    [
        (49_970.0, 0.0, 49.97),
        (49_970.0, 35.0, 49.935),
        *((stamp_ms, 0.0, 50.0) for stamp_ms in (0.0, 51_000.0, 48_000.0, 1.7e12)),
    ],
)
def test_picture_has_the_kernels_time_on_our_clock_otherwise_that_of_its_arrival(
    device, stamp_ms, latency_ms, captured_s
):
    camera = opened(device, Capture(stamp_ms), latency_ms)
    assert present(camera.take(lambda: 50.0, GO_ON)).captured_s == pytest.approx(captured_s)


def test_pictures_are_counted_and_fresh(device):
    camera = opened(device, Capture())
    shots = [present(camera.take(lambda: 1.0, GO_ON)) for _ in range(3)]
    assert [shot.number for shot in shots] == [1, 2, 3]
    assert [int(shot.image[0, 0, 0]) for shot in shots] == [2, 3, 4]
    assert not shots[0].image.flags.writeable


def test_a_few_failures_are_skipped(capture, device):
    camera = opened(device, capture)
    capture.failures, capture.empty = 2, 2
    assert present(camera.take(lambda: 1.0, GO_ON)).number == 1


def test_lasting_failure_means_the_camera_is_gone(capture, device):
    camera = opened(device, capture)
    capture.failures = 10**6
    with pytest.raises(CameraError, match="no more frames"):
        camera.take(lambda: 1.0, GO_ON)


@pytest.mark.parametrize(
    "picture", [np.full((4, 6, 4), 7, np.uint8), np.full((4, 6), 7 << 8, np.uint16)]
)
def test_grey_alpha_and_deep_pictures_become_colour(capture, device, picture):
    capture.picture = picture
    image = present(opened(device, capture).take(lambda: 1.0, GO_ON)).image
    assert image.shape == (4, 6, 3) and image.dtype == np.uint8 and (image == 7).all()


def test_frames_that_came_while_the_reader_was_away_are_counted(device):
    capture, clock = Capture(), [100.0]
    capture.stated_hz = 30.0
    camera = opened(device, capture)
    numbers = []
    for _ in range(10):
        numbers.append(present(camera.take(lambda: clock[0], GO_ON)).number)
        clock[0] += 0.1
    assert numbers[-1] == pytest.approx(28, abs=9) and numbers[0] == 1
    assert all(after - before >= 2 for before, after in zip(numbers, numbers[1:], strict=False))

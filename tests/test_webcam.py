"""A camera that is absent, forbidden or silent is named; pictures carry their own times."""

import os
import threading

import cv2
import numpy as np
import pytest

from drivers.errors import CameraError
from drivers.webcam import Webcam

GO_ON = threading.Event()


class Capture:
    """The part of cv2.VideoCapture the driver uses; ``failures`` grabs fail after the first."""

    def __init__(self, stamp_ms: float = 0.0, works: bool = True) -> None:
        self.stamp_ms = stamp_ms
        self.works = works
        self.failures = 0
        self.empty = 0
        self.grabs = 0
        self.released = False
        self.wishes: dict[int, float] = {}

    def isOpened(self) -> bool:  # noqa: N802
        return True

    def grab(self) -> bool:
        self.grabs += 1
        if self.grabs > 1 and self.failures > 0:
            self.failures -= 1
            return False
        return self.works

    def retrieve(self):
        if self.empty > 0:
            self.empty -= 1
            return True, np.zeros((0, 0, 3), np.uint8)
        return True, np.full((4, 6, 3), self.grabs, np.uint8)

    def get(self, what: int) -> float:
        return self.stamp_ms if what == cv2.CAP_PROP_POS_MSEC else 0.0

    def set(self, what: int, value: float) -> bool:
        self.wishes[what] = value
        return True

    def release(self) -> None:
        self.released = True


@pytest.fixture
def device(tmp_path):
    """A file in the place of a device file."""
    file = tmp_path / "video0"
    file.touch()
    return file


def opened(device, capture: Capture) -> Webcam:
    camera = Webcam(device, 800, 600, 25.0, capture=lambda name: capture)
    camera.open()
    return camera


def test_absent_camera_is_named_with_what_there_is(tmp_path, device):
    with pytest.raises(CameraError, match=r"no camera at .*video7 \(there is: .*video0\)"):
        Webcam(tmp_path / "video7").open()
    device.unlink()
    with pytest.raises(CameraError, match="there is: none"):
        Webcam(tmp_path / "video7").open()


def test_index_stands_for_the_device_file():
    with pytest.raises(CameraError, match="/dev/video9871 "):
        Webcam(9871).open()


def test_file_that_is_no_camera_is_refused_quietly(device, capfd):
    with pytest.raises(CameraError, match="gives no picture") as caught:
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


def test_wishes_reach_the_camera(device):
    capture = Capture()
    opened(device, capture)
    assert capture.wishes[cv2.CAP_PROP_FRAME_WIDTH] == 800
    assert capture.wishes[cv2.CAP_PROP_FRAME_HEIGHT] == 600
    assert capture.wishes[cv2.CAP_PROP_FPS] == 25.0
    assert capture.wishes[cv2.CAP_PROP_BUFFERSIZE] == 1


def test_picture_has_the_kernels_time_where_it_is_on_our_clock(device):
    camera = opened(device, Capture(stamp_ms=49_970.0))
    assert camera.take(lambda: 50.0, GO_ON).captured_s == pytest.approx(49.97)


@pytest.mark.parametrize("stamp_ms", [0.0, 51_000.0, 48_000.0, 1.7e12])
def test_picture_has_the_time_of_its_arrival_otherwise(device, stamp_ms):
    camera = opened(device, Capture(stamp_ms=stamp_ms))
    assert camera.take(lambda: 50.0, GO_ON).captured_s == 50.0


def test_pictures_are_counted_and_fresh(device):
    camera = opened(device, Capture())
    shots = [camera.take(lambda: 1.0, GO_ON) for _ in range(3)]
    assert [shot.number for shot in shots] == [1, 2, 3]
    assert [int(shot.picture[0, 0, 0]) for shot in shots] == [2, 3, 4]
    assert not shots[0].picture.flags.writeable


def test_a_few_failures_are_skipped(device):
    capture = Capture()
    camera = opened(device, capture)
    capture.failures, capture.empty = 2, 2
    assert camera.take(lambda: 1.0, GO_ON).number == 1


def test_lasting_failure_means_the_camera_is_gone(device):
    capture = Capture()
    camera = opened(device, capture)
    capture.failures = 10**6
    with pytest.raises(CameraError, match="no more pictures"):
        camera.take(lambda: 1.0, GO_ON)


def test_stop_ends_the_waiting(device):
    stop = threading.Event()
    stop.set()
    assert opened(device, Capture()).take(lambda: 1.0, stop) is None


def test_closed_camera_says_so(device):
    capture = Capture()
    camera = opened(device, capture)
    camera.close()
    camera.close()
    assert capture.released
    with pytest.raises(CameraError, match="not open"):
        camera.take(lambda: 1.0, GO_ON)

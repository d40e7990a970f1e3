"""A camera in a thread or a process keeps its newest find; its faults and its end are noticed."""

import os
import signal
import threading
import time
from functools import partial
from typing import Any, cast

import numpy as np
import pytest
from fakes.films import write_film
from fakes.waiting import wait_for
from present import present

from gazerig.drivers.camera.capture_loop import CameraParts
from gazerig.drivers.camera.film import Film
from gazerig.drivers.camera.params import RECOVERY, CameraRecovery
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.playback import CameraReplay
from gazerig.drivers.camera.recorder import RecordingWriter
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import DetectedFace
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.robot.perception.frame_locator import FrameLocator

PATIENCE_S = 20.0  # how long a test waits before it calls the thread stuck
AT_ONCE = CameraRecovery(give_up_s=0.0)
FACE = DetectedFace((1.0, 2.0, 3.0, 4.0), np.zeros((5, 2)), 0.9)
LENS = Intrinsics(60.0, 60.0, 32.0, 24.0)


def ends_with(camera: CameraWorker, words: str) -> CameraError:
    """Wait until a camera has failed for a reason that contains these words; return the error."""

    def failure() -> CameraError | None:
        try:
            camera.latest(0.0)
        except CameraError as error:
            return error
        return None

    error = wait_for(failure)
    assert error is not None and words in str(error)
    return error


def threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name == "camera"]


# --- in a thread


class Source:
    """A source that delivers one frame each time it is fed; frame k is captured at k seconds."""

    def __init__(self) -> None:
        self.fed = threading.Semaphore(0)
        self.number = self.closed = 0
        self.fault: Exception | None = None
        self.fails_to_open = False

    def open(self) -> None:
        if self.fails_to_open:
            raise CameraError("no camera: plug it in")
        self.number = 0

    def take(self, now_s, stop) -> Shot | None:
        while not self.fed.acquire(timeout=0.002):
            if stop.is_set():
                return None
        if self.fault is not None:
            raise self.fault
        self.number += 1
        return Shot(float(self.number), self.number, np.zeros((24, 32, 3), np.uint8))

    def events(self) -> tuple[str, ...]:
        return ()

    def close(self) -> None:
        self.closed += 1

    def lose(self) -> None:
        self.fault = CameraError("camera gone: check its cable")
        self.fed.release()


class EveryOther:
    """Finds a face in every second picture."""

    def __init__(self) -> None:
        self.looked = 0

    def find(self, picture) -> tuple[DetectedFace, ...]:
        self.looked += 1
        return (FACE,) if self.looked % 2 == 0 else ()


def opened(source, detector=EveryOther, care=AT_ONCE, now_s=time.monotonic) -> CameraWorker:
    camera = CameraWorker(CameraParts(lambda: source, detector), now_s, care, in_thread=True)
    camera.open()
    return camera


def feed(source: Source, camera: CameraWorker, count: int) -> None:
    goal = camera.frames + count
    source.fed.release(count)
    wait_for(lambda: camera.frames == goal and present(camera.latest(0.0)).number == goal)


@pytest.fixture
def source():
    return Source()


def test_slot_holds_the_newest_find_and_close_ends_the_thread(source):
    camera = opened(source)
    feed(source, camera, 1)
    first = present(camera.latest(0.0))
    assert (first.number, first.captured_s, first.faces) == (1, 1.0, ())
    assert (first.width_px, first.height_px) == (32, 24)
    assert present(first.image).shape == (24, 32, 3)
    feed(source, camera, 1)
    assert present(camera.latest(0.0)).faces == (FACE,)
    assert camera.latest(0.0) is camera.latest(99.0)
    assert first.number == 1  # what was handed out stays as it was
    feed(source, camera, 5)
    assert camera.frames == 7
    camera.close()
    assert source.closed == 1
    wait_for(lambda: not threads())
    camera.close()
    assert present(camera.latest(0.0)).number == 7


def test_fault_of_the_detector_reaches_the_loop_in_one_line(source):
    class Broken:
        def find(self, picture):
            raise RuntimeError("layer 3\nhas no weights")

    camera = opened(source, Broken, RECOVERY)
    source.fed.release()
    error = ends_with(camera, "RuntimeError: layer 3 has no weights")
    assert isinstance(error.__cause__, RuntimeError)
    camera.close()


def test_slow_detector_skips_pictures_and_queues_none(tmp_path):
    free = threading.Semaphore(0)
    clock = [0.0]

    class Slow:
        def find(self, picture):
            assert free.acquire(timeout=PATIENCE_S)
            return ()

    film = Film(write_film(tmp_path / "film.avi", rate_hz=10.0))
    camera = opened(film, Slow, now_s=lambda: clock[0])
    free.release()
    wait_for(lambda: camera.frames == 1)
    clock[0] = 0.15  # picture 2 is due and taken; the detector is busy with it
    free.release()
    wait_for(lambda: camera.frames == 2)
    clock[0] = 0.95
    free.release(2)
    wait_for(lambda: present(camera.latest(0.0)).number >= 10)
    assert camera.frames <= 4
    free.release(100)
    camera.close()


# --- in a process


@pytest.fixture
def recording(tmp_path):
    """Twenty pictures of grey 10 k with depth k metres and a lens."""
    writer = RecordingWriter(tmp_path / "r.mcap")
    for k in range(20):
        picture, depth = np.full((48, 64, 3), 10 * k, np.uint8), np.full((48, 64), 0.5 + k)
        writer.write(Shot(9.0 + k / 50.0, k + 1, picture, depth.astype(np.float32), LENS))
    writer.close()
    return tmp_path / "r.mcap"


def process(source, care=RECOVERY) -> CameraWorker:
    detector = partial(face_detector, FaceDetectorParams(work_width_px=64))
    parts = CameraParts(source, detector, locate=FrameLocator(None, 1.2))
    return CameraWorker(parts, time.monotonic, care)


def pid_of(camera: CameraWorker) -> int:
    return cast(Any, camera)._frames._process.pid


def test_what_was_found_comes_over_with_picture_depth_and_lens(recording):
    camera = process(partial(CameraReplay, recording))
    assert camera.latest(0.0) is None
    before_s = time.monotonic()
    camera.open()
    with pytest.raises(CameraError, match="is already open"):
        camera.open()
    wait_for(lambda: camera.frames >= 5)
    found = present(camera.latest(0.0))
    k = (found.number - 1) % 20
    assert (found.width_px, found.height_px, found.faces) == (64, 48, ())
    for values, value in ((present(found.image), 10 * k), (present(found.depth_m), 0.5 + k)):
        assert np.unique(values).tolist() == [value] and not values.flags.writeable
    assert found.lens == LENS and before_s < found.captured_s <= time.monotonic()
    camera.close()
    camera.close()
    assert not threads()
    camera.open()  # and again
    wait_for(lambda: camera.latest(0.0) is not None)
    camera.close()


def test_source_that_cannot_be_opened_says_so_at_once(tmp_path):
    camera = process(partial(Film, tmp_path / "nope.avi"))
    with pytest.raises(CameraError, match=r"no readable film or image at .*nope\.avi"):
        camera.open()
    camera.close()


class Ticking:
    """A source of 50 frames a second, which is no file."""

    number = 0

    def open(self):
        self.number = 0

    def take(self, now_s, stop):
        stop.wait(0.02)
        self.number += 1
        return Shot(now_s(), self.number, np.zeros((48, 64, 3), np.uint8))

    def events(self):
        return ()

    def close(self):
        pass


@pytest.mark.parametrize(
    ("end", "care", "reported"),
    [
        (
            signal.SIGKILL,
            CameraRecovery(0.001, 0.02, silent_s=60.0, restart_s=60.0),
            "camera lost (the camera process has ended): starting its process again",
        ),
        (
            signal.SIGSTOP,
            CameraRecovery(silent_s=1.0, restart_s=2.0),
            "camera lost (no new frame): waiting for it",
        ),
    ],
)
def test_a_process_that_ends_or_hangs_is_told_of_and_started_again(end, care, reported):
    camera = process(Ticking, care)
    camera.open()
    wait_for(lambda: camera.frames > 20)
    first, before = pid_of(camera), present(camera.latest(0.0))
    assert before.located is not None
    os.kill(first, end)
    assert camera.latest(0.0) is not None, "the last picture stays, and its age tells"
    wait_for(lambda: present(camera.latest(0.0)).number > before.number + 20)
    after = present(camera.latest(0.0))
    assert after.captured_s > before.captured_s + 0.2 and after.image is not None
    lost, back, *_ = camera.events()  # on a busy computer it may be lost again
    assert lost == reported and back.startswith("camera back after")
    assert pid_of(camera) != first
    camera.close()


def test_camera_lost_for_good_ends_with_its_reason(tmp_path):
    path = write_film(tmp_path / "film.avi", 3)
    camera = process(partial(Film, path), CameraRecovery(0.001, 0.005, give_up_s=0.1))
    camera.open()
    wait_for(lambda: camera.latest(0.0) is not None)
    path.unlink()  # it cannot be opened for its second showing
    ends_with(camera, "no readable film or image at")
    assert any(line.startswith("camera lost") for line in camera.events())
    camera.close()

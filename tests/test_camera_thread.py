"""The thread leaves the newest find in its slot, and its faults reach the loop."""

import threading
import time

import numpy as np
import pytest
from fakes.films import write_film
from fakes.waiting import wait_for
from present import present

from gazerig.drivers.camera.capture_loop import CameraParts
from gazerig.drivers.camera.film import Film
from gazerig.drivers.camera.params import CameraRecovery
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import DetectedFace

PATIENCE_S = 20.0  # how long a test waits before it calls the thread stuck

AT_ONCE = CameraRecovery(give_up_s=0.0)

FACE = DetectedFace((1.0, 2.0, 3.0, 4.0), np.zeros((5, 2)), 0.9)


class Source:
    """A source that delivers one frame each time it is fed; frame k is captured at k seconds."""

    def __init__(self, fails_to_open: bool = False) -> None:
        self.fed = threading.Semaphore(0)
        self.number = 0
        self.opened = 0
        self.closed = 0
        self.fault: Exception | None = None
        self.news: list[str] = []
        self.fails_to_open = fails_to_open

    def open(self) -> None:
        if self.fails_to_open:
            raise CameraError("no camera: plug it in")
        self.opened += 1
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
        reported, self.news = tuple(self.news), []
        return reported

    def close(self) -> None:
        self.closed += 1


class EveryOther:
    """Finds a face in every second picture."""

    def __init__(self) -> None:
        self.looked = 0

    def find(self, picture) -> tuple[DetectedFace, ...]:
        self.looked += 1
        return (FACE,) if self.looked % 2 == 0 else ()


def worker(source, detector=EveryOther, care=AT_ONCE, now_s=time.monotonic) -> CameraWorker:
    return CameraWorker(CameraParts(lambda: source, detector), now_s, care, in_thread=True)


@pytest.fixture
def source():
    return Source()


@pytest.fixture
def camera(source):
    thread = worker(source)
    thread.open()
    yield thread
    thread.close()


def feed(source: Source, camera: CameraWorker, count: int) -> None:
    goal = camera.frames + count
    for _ in range(count):
        source.fed.release()
    wait_for(lambda: camera.frames == goal and present(camera.latest(0.0)).number == goal)


def test_slot_holds_the_newest_find(source, camera):
    feed(source, camera, 1)
    first = camera.latest(0.0)
    assert (first.number, first.captured_s, first.faces) == (1, 1.0, ())
    assert (first.width_px, first.height_px) == (32, 24)
    assert first.image.shape == (24, 32, 3)
    feed(source, camera, 1)
    assert camera.latest(0.0).faces == (FACE,)
    assert camera.latest(0.0) is camera.latest(99.0)
    assert first.number == 1  # what was handed out stays as it was


def test_pictures_and_pictures_with_a_face_are_counted(source, camera):
    feed(source, camera, 7)
    assert (camera.frames, camera.frames_with_face) == (7, 3)


def test_fault_of_the_source_reaches_the_loop(source, camera):
    source.fault = CameraError("camera gone: check its cable")
    source.fed.release()
    wait_for(lambda: source.closed)
    for _ in range(2):
        with pytest.raises(CameraError, match="check its cable"):
            camera.latest(0.0)


def test_fault_of_the_detector_reaches_the_loop_in_one_line(source):
    class Broken:
        def find(self, picture):
            raise RuntimeError("layer 3\nhas no weights")

    thread = worker(source, Broken)
    thread.open()
    source.fed.release()
    wait_for(lambda: source.closed)
    with pytest.raises(CameraError, match="RuntimeError: layer 3 has no weights") as caught:
        thread.latest(0.0)
    assert isinstance(caught.value.__cause__, RuntimeError)
    thread.close()


def test_close_ends_the_thread_and_frees_the_source(source, camera):
    feed(source, camera, 1)
    camera.close()
    assert source.closed == 1
    wait_for(lambda: not [t for t in threading.enumerate() if t.name == "camera"])
    camera.close()
    assert camera.latest(0.0).number == 1


def lose(source: Source) -> None:
    source.fault = CameraError("camera gone: check its cable")
    source.fed.release()


def test_waits_between_tries_double_up_to_the_longest(source):
    waits: list[float] = []
    care = CameraRecovery(0.1, 0.35, give_up_s=1.0)
    clock = [0.0]
    camera = worker(source, care=care, now_s=lambda: clock[0])

    class Stop(threading.Event):
        def wait(self, timeout=None) -> bool:
            waits.append(timeout)
            clock[0] += timeout
            return self.is_set()

    camera._stop = Stop()
    camera.open()
    lose(source)
    source.fails_to_open = True
    with pytest.raises(CameraError, match="plug it in"):
        wait_for(lambda: camera.latest(0.0) is not None)
    assert waits == pytest.approx([0.1, 0.2, 0.35, 0.35])
    camera.close()


def test_close_does_not_wait_for_a_lost_camera(source):
    care = CameraRecovery(60.0, 60.0, give_up_s=86_400.0)
    camera = worker(source, care=care)
    camera.open()
    lose(source)
    wait_for(lambda: source.closed)
    camera.close()
    wait_for(lambda: not [t for t in threading.enumerate() if t.name == "camera"])
    assert camera.latest(0.0) is None


def test_slow_detector_skips_pictures_and_queues_none(tmp_path):
    free = threading.Semaphore(0)
    clock = [0.0]

    class Slow:
        def find(self, picture):
            assert free.acquire(timeout=PATIENCE_S)
            return ()

    film = Film(write_film(tmp_path / "film.avi", rate_hz=10.0))
    camera = worker(film, Slow, now_s=lambda: clock[0])
    camera.open()
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

"""Test suite for every kind of camera.

class TestMyCamera(CameraSuite):
    @pytest.fixture
    def bench(self):
        device = FakeDevice()
        return of_source(lambda: MySource(device), lose=device.pull, restore=device.plug)
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite

import numpy as np
import pytest

from gazerig.drivers.camera.params import CameraRecovery
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.thread import CameraThread
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import Camera, DetectedFace, Detections, ImageArray

LONGEST_S = 60.0
"""A camera that takes longer hangs; a working camera needs a thousandth of this time."""

QUICKLY = CameraRecovery(0.001, 0.005, LONGEST_S)


def _wait() -> None:
    time.sleep(0.001)  # noqa: TID251 - waits for a camera's thread


@dataclass(frozen=True)
class CameraBench:
    """A camera and its device.

    Attributes:
        make: creates another camera on the same device.
        now_s: clock of its frames.
        wait: waits for a short time.
        lose, restore: remove the device and bring it back; None: not possible.
        block, release: make the device block its reader, and release it; None: not possible.
    """

    make: Callable[[], Camera]
    now_s: Callable[[], float] = time.monotonic  # noqa: TID251 - that of real cameras
    wait: Callable[[], None] = _wait
    lose: Callable[[], None] | None = None
    restore: Callable[[], None] | None = None
    block: Callable[[], None] | None = None
    release: Callable[[], None] | None = None


class _NoDetections:
    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        return ()


def of_source(
    make: Callable[[], FrameSource],
    lose: Callable[[], None] | None = None,
    restore: Callable[[], None] | None = None,
    block: Callable[[], None] | None = None,
    release: Callable[[], None] | None = None,
) -> CameraBench:
    """Return the bench of a frame source, which a thread reads as in a run."""
    now_s = time.monotonic  # noqa: TID251 - that of real cameras
    return CameraBench(
        lambda: CameraThread(make(), _NoDetections(), now_s, QUICKLY),
        lose=lose, restore=restore, block=block, release=release,
    )  # fmt: skip


class CameraSuite:
    """Rising frame numbers and times, loss and recovery, and a loop that never waits."""

    @pytest.fixture
    def bench(self) -> CameraBench:
        """Return the camera under test."""
        raise NotImplementedError("define a fixture bench that returns a CameraBench")

    def until(self, bench: CameraBench, done: Callable[[], object]) -> None:
        """Wait until a condition is true."""
        end_s = time.monotonic() + LONGEST_S  # noqa: TID251
        while not done():
            assert time.monotonic() < end_s, "the camera hangs"  # noqa: TID251
            bench.wait()

    def next_frame(self, bench: CameraBench, camera: Camera, after: int) -> Detections:
        """Return a frame with a higher number."""
        newest: list[Detections] = []

        def there() -> bool:
            found = camera.latest(bench.now_s())
            if found is not None and found.number > after:
                newest.append(found)
            return bool(newest)

        self.until(bench, there)
        return newest[0]

    @pytest.fixture
    def camera(self, bench):
        camera = bench.make()
        camera.open()
        yield camera
        if bench.release is not None:
            bench.release()
        camera.close()

    def test_frames_rise_in_number_and_time_and_are_never_of_the_future(self, bench, camera):
        frame = self.next_frame(bench, camera, 0)
        for _ in range(8):
            later = self.next_frame(bench, camera, frame.number)
            assert later.captured_s > frame.captured_s
            assert later.captured_s <= bench.now_s() + 1e-6
            frame = later

    def test_what_it_returns_is_sound(self, bench, camera):
        frame = self.next_frame(bench, camera, 0)
        assert isinstance(frame, Detections) and isfinite(frame.captured_s)
        assert isinstance(frame.number, int) and frame.width_px > 0 and frame.height_px > 0
        for face in frame.faces:
            assert isinstance(face, DetectedFace) and np.isfinite(face.box_px).all()
            assert face.landmarks_px.shape == (5, 2) and np.isfinite(face.landmarks_px).all()
        if frame.image is not None:
            assert frame.image.shape == (frame.height_px, frame.width_px, 3)
            assert frame.image.dtype == np.uint8 and not frame.image.flags.writeable
        if frame.depth_m is not None:
            assert frame.depth_m.shape == (frame.height_px, frame.width_px)

    def test_the_same_frame_is_the_same_value(self, bench, camera):
        self.next_frame(bench, camera, 0)
        now_s = bench.now_s()
        one, other = camera.latest(now_s), camera.latest(now_s)
        assert one is not None and other is not None and other.number >= one.number

    def test_events_are_lines_and_told_once(self, bench, camera):
        self.next_frame(bench, camera, 0)
        assert all(isinstance(line, str) and "\n" not in line for line in camera.events())
        assert camera.events() == ()

    def test_it_is_closed_twice_and_opened_again(self, bench):
        camera = bench.make()
        for _ in range(2):
            camera.open()
            self.next_frame(bench, camera, 0)
            camera.close()
            camera.close()

    def test_it_is_closed_without_having_been_opened(self, bench):
        bench.make().close()

    def test_latest_does_not_wait_for_a_device_that_blocks(self, bench, camera):
        if bench.block is None:
            return
        self.next_frame(bench, camera, 0)
        bench.block()
        asked = threading.Thread(
            target=lambda: [camera.latest(bench.now_s()) for _ in range(100)], daemon=True
        )
        asked.start()
        asked.join(LONGEST_S)
        assert not asked.is_alive(), "latest() waits for its device"

    def test_a_device_that_is_not_there_is_refused_in_one_line(self, bench):
        if bench.lose is None:
            return
        bench.lose()
        camera = bench.make()
        with pytest.raises(CameraError) as caught:
            camera.open()
        assert str(caught.value) and "\n" not in str(caught.value)
        camera.close()
        bench.restore()
        camera = bench.make()
        camera.open()
        self.next_frame(bench, camera, 0)
        camera.close()

    def test_a_device_that_goes_and_comes_back_is_told_of_and_numbers_go_on(self, bench, camera):
        if bench.lose is None:
            return
        before = self.next_frame(bench, camera, 0)
        told = list(camera.events())

        def says(word: str) -> bool:
            camera.latest(bench.now_s())  # as the loop does in every tick
            told.extend(camera.events())
            return any(word in line for line in told)

        bench.lose()
        self.until(bench, lambda: says("lost"))
        stands = camera.latest(bench.now_s())
        assert stands is None or stands.number >= before.number
        bench.restore()
        last = stands.number if stands is not None else before.number
        after = self.next_frame(bench, camera, last)
        assert after.captured_s > before.captured_s
        self.until(bench, lambda: says("back"))
        assert all("\n" not in line for line in told)

"""Test suite for every kind of camera.

class TestMyCamera(CameraSuite):
    @pytest.fixture
    def bench(self):
        device = FakeDevice()
        return of_source(lambda: MySource(device), lose=device.pull)
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import isfinite

import numpy as np
import pytest

from gazerig.drivers.camera.capture_loop import CameraParts
from gazerig.drivers.camera.params import CameraRecovery
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import Camera, DetectedFace, Detections, ImageArray

LONGEST_S = 60.0
"""A camera that takes longer hangs; a working camera needs a thousandth of this time."""


@dataclass(frozen=True)
class CameraBench:
    """A camera and its device.

    Attributes:
        make: creates another camera on the same device.
        now_s: clock of its frames.
        wait: waits for a short time.
        lose: removes the device; None: not possible.
    """

    make: Callable[[], Camera]
    now_s: Callable[[], float] = time.monotonic  # noqa: TID251 - that of real cameras
    wait: Callable[[], None] = lambda: time.sleep(0.001)  # noqa: TID251 - for its thread
    lose: Callable[[], None] | None = None

    def next_frame(self, camera: Camera, after: int = 0) -> Detections:
        """Wait for a frame with a higher number, and return it."""
        end_s = time.monotonic() + LONGEST_S  # noqa: TID251
        while (frame := camera.latest(self.now_s())) is None or frame.number <= after:
            assert time.monotonic() < end_s, "the camera hangs"  # noqa: TID251
            self.wait()
        return frame


class _NoDetections:
    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        return ()


def of_source(
    make: Callable[[], FrameSource], lose: Callable[[], None] | None = None
) -> CameraBench:
    """Return the bench of a frame source, which a thread reads as in a run."""
    quickly = CameraRecovery(0.001, 0.005, LONGEST_S)
    parts = CameraParts(make, _NoDetections), CameraBench.now_s, quickly
    return CameraBench(lambda: CameraWorker(*parts, in_thread=True), lose=lose)


class CameraSuite:
    """Rising frame numbers and times, sound frames, opening again, an absent device.

    A class defines the fixture ``bench``, which returns a ``CameraBench``.
    """

    @pytest.fixture
    def camera(self, bench: CameraBench) -> Iterator[Camera]:
        """Return the camera, which is open."""
        camera = bench.make()
        camera.open()
        yield camera
        camera.close()

    def test_frames_rise_in_number_and_time_and_are_never_of_the_future(self, bench, camera):
        frame = bench.next_frame(camera)
        for _ in range(8):
            later = bench.next_frame(camera, frame.number)
            assert frame.captured_s < later.captured_s <= bench.now_s() + 1e-6
            frame = later

    def test_what_it_returns_is_sound(self, bench, camera):
        frame = bench.next_frame(camera)
        assert isinstance(frame, Detections) and isfinite(frame.captured_s)
        assert frame.width_px > 0 and frame.height_px > 0
        for face in frame.faces:
            assert np.isfinite(face.box_px).all()
            assert face.landmarks_px.shape == (5, 2) and np.isfinite(face.landmarks_px).all()
        if frame.image is not None:
            assert frame.image.shape == (frame.height_px, frame.width_px, 3)
            assert frame.image.dtype == np.uint8 and not frame.image.flags.writeable
        if frame.depth_m is not None:
            assert frame.depth_m.shape == (frame.height_px, frame.width_px)

    def test_it_is_closed_twice_and_opened_again(self, bench):
        bench.make().close()
        camera = bench.make()
        for _ in range(2):
            camera.open()
            bench.next_frame(camera)
            camera.close()
            camera.close()

    def test_a_device_that_is_not_there_is_refused_in_one_line(self, bench):
        if bench.lose is None:
            return
        bench.lose()
        camera = bench.make()
        with pytest.raises(CameraError) as caught:
            camera.open()
        assert str(caught.value) and "\n" not in str(caught.value)
        camera.close()

"""A camera in a process of its own gives what the thread gives, and its end is noticed."""

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
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.robot.perception.frame_locator import FrameLocator

DETECTOR = partial(face_detector, FaceDetectorParams(work_width_px=64))
LOCATOR = FrameLocator(None, 1.2)


@pytest.fixture
def recording(tmp_path):
    """Twenty pictures of grey 10 k with depth k metres and a lens."""
    writer = RecordingWriter(tmp_path / "r.mcap")
    for k in range(20):
        picture = np.full((48, 64, 3), 10 * k, np.uint8)
        depth = np.full((48, 64), 0.5 + k, np.float32)
        writer.write(
            Shot(9.0 + k / 50.0, k + 1, picture, depth, Intrinsics(60.0, 60.0, 32.0, 24.0))
        )
    writer.close()
    return tmp_path / "r.mcap"


def process(source, care=RECOVERY) -> CameraWorker:
    return CameraWorker(CameraParts(source, DETECTOR, locate=LOCATOR), time.monotonic, care)


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
    assert found.lens == Intrinsics(60.0, 60.0, 32.0, 24.0)
    assert before_s < found.captured_s <= time.monotonic()
    camera.close()
    camera.close()
    assert not [t for t in threading.enumerate() if t.name == "camera"]
    camera.open()  # and again
    wait_for(lambda: camera.latest(0.0) is not None)
    camera.close()


def test_source_that_cannot_be_opened_says_so_at_once(tmp_path):
    camera = process(partial(Film, tmp_path / "nope.avi"))
    with pytest.raises(CameraError, match=r"no readable film or image at .*nope\.avi"):
        camera.open()
    camera.close()


QUICK = CameraRecovery(0.001, 0.02, silent_s=60.0, restart_s=60.0)


def test_a_killed_process_is_started_again_and_the_rest_goes_on(recording):
    camera = process(partial(CameraReplay, recording), QUICK)
    camera.open()
    wait_for(lambda: camera.latest(0.0) is not None)
    assert present(camera.latest(0.0)).located is not None
    first, before = pid_of(camera), camera.latest(0.0)
    os.kill(first, signal.SIGKILL)
    assert camera.latest(0.0) is not None, "the last picture stays, and its age tells"
    wait_for(lambda: present(camera.latest(0.0)).captured_s > present(before).captured_s + 0.2)
    after = camera.latest(0.0)
    assert present(after).number > present(before).number
    assert present(after).image is not None
    assert pid_of(camera) != first
    lost, back = camera.events()
    assert lost.startswith("camera lost (the camera process has ended)")
    assert back.startswith("camera back after")
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


def test_a_process_that_hangs_is_told_of_and_started_again():
    camera = process(Ticking, CameraRecovery(silent_s=1.0, restart_s=2.0))
    camera.open()
    wait_for(lambda: camera.frames > 20)
    first = pid_of(camera)
    os.kill(first, signal.SIGSTOP)
    before = camera.latest(0.0)
    wait_for(lambda: present(camera.latest(0.0)).number > present(before).number + 20)
    lost, back = camera.events()
    assert lost == "camera lost (no new frame): waiting for it" and back.startswith("camera back")
    assert pid_of(camera) != first
    camera.close()


def test_a_film_that_pauses_is_no_lost_camera(recording):
    camera = process(partial(CameraReplay, recording), CameraRecovery(silent_s=0.1, restart_s=0.2))
    camera.open()
    wait_for(lambda: camera.frames > 5)
    os.kill(pid_of(camera), signal.SIGSTOP)
    before = camera.frames
    time.sleep(1.0)
    os.kill(pid_of(camera), signal.SIGCONT)
    wait_for(lambda: camera.frames > before)
    assert camera.events() == ()
    camera.close()


def test_camera_lost_for_good_ends_with_its_reason(tmp_path):
    path = write_film(tmp_path / "film.avi", 3)
    care = CameraRecovery(0.001, 0.005, give_up_s=0.1)
    camera = process(partial(Film, path), care)
    camera.open()
    wait_for(lambda: camera.latest(0.0) is not None)
    path.unlink()  # it cannot be opened for its second showing

    def gone() -> bool:
        try:
            camera.latest(0.0)
        except CameraError as error:
            return "no readable film or image at" in str(error)
        return False

    wait_for(gone)
    assert any(line.startswith("camera lost") for line in camera.events())
    camera.close()


class Flawed(Ticking):
    """A source that fails at its tenth frame, not as a lost camera does."""

    def take(self, now_s, stop):
        if self.number == 9:
            raise RuntimeError("no memory")
        return super().take(now_s, stop)


def test_an_exception_in_the_process_ends_the_camera_with_its_reason():
    camera = process(Flawed)
    camera.open()

    def failed() -> bool:
        try:
            camera.latest(0.0)
        except CameraError as error:
            return "failed (RuntimeError: no memory)" in str(error)
        return False

    wait_for(failed)
    camera.close()

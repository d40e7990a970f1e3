"""A camera in a process of its own gives what the thread gives, and its end is noticed."""

import os
import signal
import threading
import time
from functools import partial

import cv2
import numpy as np
import pytest

from drivers.camera_params import CameraCareParams
from drivers.camera_process import CameraParts, CameraProcess
from drivers.camera_replay import CameraReplay
from drivers.camera_slots import SlotReader, SlotWriter
from drivers.errors import CameraError, ModelFileError
from drivers.face_detector import face_detector
from drivers.face_params import FaceDetectorParams
from drivers.picture_source import Shot
from drivers.recording_write import RecordingWriter
from drivers.types import PictureLens
from drivers.video_file import VideoFile

PATIENCE_S = 40.0
DETECTOR = partial(face_detector, FaceDetectorParams(work_width_px=64))


def wait_for(what) -> None:
    """Wait until something holds."""
    end = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < end, "the camera process is stuck"
        time.sleep(0.002)


@pytest.fixture
def recording(tmp_path):
    """Twenty pictures of grey 10 k with depth k metres and a lens."""
    writer = RecordingWriter(tmp_path / "r.mcap", {})
    for k in range(20):
        picture = np.full((48, 64, 3), 10 * k, np.uint8)
        depth = np.full((48, 64), 0.5 + k, np.float32)
        writer.write(
            Shot(9.0 + k / 50.0, k + 1, picture, depth, PictureLens(60.0, 60.0, 32.0, 24.0))
        )
    writer.close()
    return tmp_path / "r.mcap"


def process(source, care=None) -> CameraProcess:
    return CameraProcess(CameraParts(source, DETECTOR), time.monotonic, care)


def test_what_was_found_comes_over_with_picture_depth_and_lens(recording):
    camera = process(partial(CameraReplay, recording))
    assert camera.latest(0.0) is None
    before_s = time.monotonic()
    camera.open()
    with pytest.raises(CameraError, match="runs already"):
        camera.open()
    numbers = set()
    wait_for(lambda: camera.pictures >= 5)
    for _ in range(20):
        found = camera.latest(0.0)
        k = (found.number - 1) % 20
        assert (found.width_px, found.height_px, found.faces) == (64, 48, ())
        assert found.picture is not None and found.depth_m is not None
        assert np.unique(found.picture).tolist() == [10 * k]
        assert np.unique(found.depth_m).tolist() == [0.5 + k]
        assert not found.picture.flags.writeable and not found.depth_m.flags.writeable
        assert found.lens == (60.0, 60.0, 32.0, 24.0)
        assert before_s < found.captured_s <= time.monotonic()
        numbers.add(found.number)
        time.sleep(0.01)
    assert len(numbers) > 1
    camera.close()
    camera.close()
    assert not [t for t in threading.enumerate() if t.name == "camera"]
    camera.open()  # and anew
    wait_for(lambda: camera.latest(0.0) is not None)
    camera.close()


def test_source_that_cannot_be_opened_says_so_at_once(tmp_path):
    camera = process(partial(VideoFile, tmp_path / "nope.avi"))
    with pytest.raises(CameraError, match=r"no film or picture at .*nope\.avi"):
        camera.open()
    camera.close()


def test_detector_that_cannot_be_made_says_so_at_once(recording):
    params = FaceDetectorParams(kind="yunet", model_file="/nowhere/yunet.onnx")
    parts = CameraParts(partial(CameraReplay, recording), partial(face_detector, params))
    with pytest.raises(ModelFileError, match=r"yunet\.onnx"):
        CameraProcess(parts, time.monotonic).open()


def test_killed_process_is_noticed(recording):
    camera = process(partial(CameraReplay, recording))
    camera.open()
    wait_for(lambda: camera.latest(0.0) is not None)
    os.kill(camera._process.pid, signal.SIGKILL)

    def noticed() -> bool:
        try:
            camera.latest(0.0)
        except CameraError as error:
            return "has ended" in str(error)
        return False

    wait_for(noticed)
    camera.close()


def test_camera_lost_for_good_ends_with_its_reason(tmp_path):
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 50.0, (64, 48))
    for k in range(3):
        writer.write(np.full((48, 64, 3), 20 * k, np.uint8))
    writer.release()
    care = CameraCareParams(retry_ms=1.0, longest_retry_ms=5.0, give_up_s=0.1)
    camera = process(partial(VideoFile, path), care)
    camera.open()
    wait_for(lambda: camera.latest(0.0) is not None)
    path.unlink()  # it cannot be opened for its second showing

    def gone() -> bool:
        try:
            camera.latest(0.0)
        except CameraError:
            return True
        return False

    wait_for(gone)
    with pytest.raises(CameraError, match="no film or picture at"):
        camera.latest(0.0)
    told = camera.events()
    assert any(line.startswith("camera lost") for line in told)
    camera.close()


def test_slots_carry_arrays_of_any_shape_and_give_up_overwritten_ones():
    writer, reader = SlotWriter(), SlotReader()
    try:
        for shape in ((3, 4, 3), (480, 640, 3), (2, 2), (600, 800, 3)):
            array = np.random.default_rng(1).integers(0, 255, shape, np.uint8)
            where = writer.put(array)
            assert np.array_equal(reader.take(where), array)
        depth = np.array([[1.5, np.nan]], np.float32)
        assert np.array_equal(reader.take(writer.put(depth)), depth, equal_nan=True)
        old = writer.put(np.zeros((4, 4), np.uint8))
        for _ in range(6):
            newest = writer.put(np.ones((4, 4), np.uint8))
        assert reader.take(old) is None
        assert reader.take(newest).all()
    finally:
        reader.close()
        writer.close()
    assert SlotReader().take(newest) is None

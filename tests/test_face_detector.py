"""Faces are found where they are, the same each time, and nothing breaks the search."""

import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from skimage import data

from gazerig.drivers.errors import ModelFileError, SetupError
from gazerig.drivers.types import DetectedFace, FaceDetector, ImageArray, Pixels
from gazerig.drivers.vision.face.auto import AutoDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector, read_model
from gazerig.drivers.vision.face.params import FaceDetectorParams

SHARED = Path(__file__).parents[2] / "shared"
YUNET_FILE = SHARED / "models" / "face_detection_yunet_2026may.onnx"

needs_yunet = pytest.mark.skipif(not YUNET_FILE.exists(), reason=f"no {YUNET_FILE}")

# Marked by hand in a 16-fold enlargement, to half a pixel: right eye, left eye, nose tip,
# right and left mouth corner of the person in the picture.
ASTRONAUT_PX = np.array(
    [(203.2, 100.6), (246.7, 102.9), (225.2, 127.2), (203.2, 139.8), (243.7, 140.9)]
)
ASTRONAUT_EYES_PX = float(np.linalg.norm(ASTRONAUT_PX[1] - ASTRONAUT_PX[0]))


@pytest.fixture(scope="module")
def mtcnn() -> FaceDetector:
    return MtcnnDetector(FaceDetectorParams())


@pytest.fixture(scope="module")
def astronaut() -> ImageArray:
    return cv2.cvtColor(data.astronaut(), cv2.COLOR_RGB2BGR)


def scene(photo: ImageArray, size: tuple[int, int], eyes_px: float, roll_deg: float = 0.0):
    """Put the photo's face into the middle of a picture: the picture and the true landmarks."""
    scale = eyes_px / ASTRONAUT_EYES_PX
    centre = ASTRONAUT_PX.mean(axis=0)
    M = cv2.getRotationMatrix2D(tuple(centre), roll_deg, scale)
    M[:, 2] += np.array(size) / 2 - centre
    soft = cv2.GaussianBlur(photo, (0, 0), 0.4 / scale) if scale < 1 else photo
    picture = cv2.warpAffine(soft, M, size, borderValue=(120, 120, 120))
    return picture, ASTRONAUT_PX @ M[:, :2].T + M[:, 2]


def error_of_eyes(face: DetectedFace, truth: Pixels) -> float:
    """Mean landmark error as a part of the distance between the eyes."""
    eyes = np.linalg.norm(truth[1] - truth[0])
    return float(np.linalg.norm(face.landmarks_px - truth, axis=1).mean() / eyes)


# ---- MTCNN ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "eyes_px", "roll_deg", "bound"),
    [
        ((320, 240), 15, 0, 0.06),
        ((320, 240), 60, 0, 0.06),
        ((1280, 720), 120, 0, 0.06),
        ((320, 240), 30, -20, 0.08),
        ((320, 240), 30, -35, 0.12),
    ],
)
def test_photographed_face_is_found_with_its_landmarks(
    mtcnn, astronaut, size, eyes_px, roll_deg, bound
):
    picture, truth = scene(astronaut, size, eyes_px, roll_deg)
    (face,) = mtcnn.find(picture)
    assert error_of_eyes(face, truth) < bound
    assert face.confidence > 0.9


def test_landmarks_are_in_the_picture_given_whatever_size_is_searched(astronaut):
    picture, truth = scene(astronaut, (1280, 960), 160)
    for width_px in (160, 320, 640):
        detector = MtcnnDetector(FaceDetectorParams(work_width_px=width_px))
        assert error_of_eyes(detector.find(picture)[0], truth) < 0.06


def test_mean_landmark_error_has_no_half_pixel_in_it(mtcnn, astronaut):
    offsets = []
    for step in range(8):
        picture, truth = scene(astronaut, (320 + step, 240 + step), 15)
        offsets.append((mtcnn.find(picture)[0].landmarks_px - truth).mean(axis=0))
    assert np.abs(np.mean(offsets, axis=0)).max() < 0.4


def test_larger_face_comes_first(mtcnn, astronaut):
    small, large = scene(astronaut, (200, 240), 20)[0], scene(astronaut, (320, 240), 60)[0]
    faces = mtcnn.find(np.hstack([small, large]))
    assert [f.landmarks_px[2, 0] > 200 for f in faces] == [True, False]


def test_face_cut_by_the_border_keeps_its_place(mtcnn, astronaut):
    picture, truth = scene(astronaut, (320, 240), 60)
    cut = 105
    (face,) = mtcnn.find(np.ascontiguousarray(picture[:, cut:]))
    assert error_of_eyes(face, truth - (cut, 0)) < 0.12


def test_no_face_is_seen_where_there_is_none(mtcnn):
    noise = np.random.default_rng(3).integers(0, 256, (240, 320, 3), np.uint8)
    photos = (cv2.cvtColor(photo, cv2.COLOR_GRAY2BGR) for photo in (data.coins(), data.brick()))
    for picture in (np.zeros((240, 320, 3), np.uint8), noise, *photos):
        assert mtcnn.find(picture) == ()


def test_same_picture_same_numbers_whatever_came_before(mtcnn, astronaut):
    picture, _ = scene(astronaut, (320, 240), 40)
    fresh = MtcnnDetector(FaceDetectorParams())
    for other in (astronaut, np.zeros((100, 50, 3), np.uint8)):
        mtcnn.find(other)
    first, second = mtcnn.find(picture)[0], fresh.find(picture)[0]
    assert second.landmarks_px.tobytes() == first.landmarks_px.tobytes()
    assert (second.box_px, second.confidence) == (first.box_px, first.confidence)


DEGENERATE = {"1x1": (1, 1, 3), "no rows": (0, 40, 3), "one row": (1, 2000, 3), "grey": (50, 60, 3)}


def grey(shape: tuple[int, ...]) -> ImageArray:
    return np.full(shape, 90, np.uint8)


@pytest.mark.parametrize("shape", DEGENERATE.values(), ids=DEGENERATE)
def test_odd_pictures_hold_no_face(mtcnn, shape):
    assert mtcnn.find(grey(shape)) == ()


def test_altered_or_missing_model_file_names_the_cure(tmp_path):
    (tmp_path / "rnet.onnx").write_bytes(b"something else")
    with pytest.raises(ModelFileError, match=r"rnet\.onnx is not the file .*pip install"):
        read_model(tmp_path, "rnet")
    with pytest.raises(ModelFileError, match=r"cannot read .*onet\.onnx.*pip install"):
        read_model(tmp_path, "onet")


def test_unknown_detector_is_refused():
    with pytest.raises(SetupError, match="'other': there is auto"):
        face_detector(FaceDetectorParams(kind="other"))


# ---- YuNet ------------------------------------------------------------------------------


@needs_yunet
@pytest.mark.parametrize(
    ("size", "eyes_px", "bound"),
    [((320, 240), 20, 0.15), ((320, 240), 50, 0.15), ((1280, 720), 120, 0.15)],
)
def test_yunet_alone_finds_the_photographed_face(astronaut, size, eyes_px, bound, monkeypatch):
    monkeypatch.setenv("GAZERIG_MODELS", str(YUNET_FILE.parent))
    monkeypatch.setitem(sys.modules, "gazerig.drivers.vision.face.mtcnn", None)  # not there
    detector = AutoDetector(FaceDetectorParams())
    picture, truth = scene(astronaut, size, eyes_px)
    for _ in range(6):
        (face,) = detector.find(picture)
        assert error_of_eyes(face, truth) < bound
    assert "yunet finds the faces" in detector.events()[0]

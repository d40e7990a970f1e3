"""Faces are found where they are, the same each time, and nothing breaks the search."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from seeing.material import landmark_error, paste, portrait
from skimage import data

from gazerig.drivers.errors import ModelFileError, SetupError
from gazerig.drivers.types import FaceDetector, ImageArray, Pixels
from gazerig.drivers.vision.face.auto import AutoDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector, read_model
from gazerig.drivers.vision.face.params import FaceDetectorParams

SHARED = Path(__file__).parents[4] / "shared"
YUNET_FILE = SHARED / "models" / "face_detection_yunet_2026may.onnx"

needs_yunet = pytest.mark.skipif(not YUNET_FILE.exists(), reason=f"no {YUNET_FILE}")

ASTRONAUT = portrait("astronaut")


@pytest.fixture(scope="module")
def mtcnn() -> FaceDetector:
    return MtcnnDetector(FaceDetectorParams())


def scene(
    size: tuple[int, int], eyes_px: float, roll_deg: float = 0.0
) -> tuple[ImageArray, Pixels]:
    """Put the photo's face into the middle of a picture: the picture and the true landmarks."""
    picture = np.full((size[1], size[0], 3), 120, np.uint8)
    return picture, paste(picture, ASTRONAUT, (size[0] / 2, size[1] / 2), eyes_px, roll_deg)


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
def test_photographed_face_is_found_with_its_landmarks(mtcnn, size, eyes_px, roll_deg, bound):
    picture, truth = scene(size, eyes_px, roll_deg)
    (face,) = mtcnn.find(picture)
    assert landmark_error(face, truth) < bound
    assert face.confidence > 0.9


def test_landmarks_are_in_the_picture_given_whatever_size_is_searched():
    picture, truth = scene((1280, 960), 160)
    for width_px in (160, 320, 640):
        detector = MtcnnDetector(FaceDetectorParams(work_width_px=width_px))
        assert landmark_error(detector.find(picture)[0], truth) < 0.06


def test_mean_landmark_error_has_no_half_pixel_in_it(mtcnn):
    offsets = []
    for step in range(8):
        picture, truth = scene((320 + step, 240 + step), 15)
        offsets.append((mtcnn.find(picture)[0].landmarks_px - truth).mean(axis=0))
    assert np.abs(np.mean(offsets, axis=0)).max() < 0.4


def test_larger_face_comes_first(mtcnn):
    small, large = scene((200, 240), 20)[0], scene((320, 240), 60)[0]
    faces = mtcnn.find(np.hstack([small, large]))
    assert [f.landmarks_px[2, 0] > 200 for f in faces] == [True, False]


def test_face_cut_by_the_border_keeps_its_place(mtcnn):
    picture, truth = scene((320, 240), 60)
    cut = 105
    (face,) = mtcnn.find(np.ascontiguousarray(picture[:, cut:]))
    assert landmark_error(face, truth - (cut, 0)) < 0.12


def test_no_face_is_seen_where_there_is_none(mtcnn):
    noise = np.random.default_rng(3).integers(0, 256, (240, 320, 3), np.uint8)
    photos = (cv2.cvtColor(photo, cv2.COLOR_GRAY2BGR) for photo in (data.coins(), data.brick()))
    for picture in (np.zeros((240, 320, 3), np.uint8), noise, *photos):
        assert mtcnn.find(picture) == ()


def test_same_picture_same_numbers_whatever_came_before(mtcnn):
    picture, _ = scene((320, 240), 40)
    fresh = MtcnnDetector(FaceDetectorParams())
    for other in (ASTRONAUT.image, np.zeros((100, 50, 3), np.uint8)):
        mtcnn.find(other)
    first, second = mtcnn.find(picture)[0], fresh.find(picture)[0]
    assert second.landmarks_px.tobytes() == first.landmarks_px.tobytes()
    assert (second.box_px, second.confidence) == (first.box_px, first.confidence)


DEGENERATE = {"1x1": (1, 1, 3), "no rows": (0, 40, 3), "one row": (1, 2000, 3), "grey": (50, 60, 3)}


@pytest.mark.parametrize("shape", DEGENERATE.values(), ids=DEGENERATE)
def test_odd_pictures_hold_no_face(mtcnn, shape):
    assert mtcnn.find(np.full(shape, 90, np.uint8)) == ()


def test_altered_or_missing_model_file_names_the_cure(tmp_path):
    (tmp_path / "rnet.onnx").write_bytes(b"something else")
    with pytest.raises(ModelFileError, match=r"rnet\.onnx is not the file .*pip install"):
        read_model(tmp_path, "rnet")
    with pytest.raises(ModelFileError, match=r"cannot read .*onet\.onnx.*pip install"):
        read_model(tmp_path, "onet")


def test_unknown_detector_is_refused():
    with pytest.raises(SetupError, match="no detector 'other'; available: auto"):
        face_detector(FaceDetectorParams(kind="other"))


# ---- YuNet ------------------------------------------------------------------------------


@needs_yunet
@pytest.mark.parametrize(
    ("size", "eyes_px", "bound"),
    [((320, 240), 20, 0.15), ((320, 240), 50, 0.15), ((1280, 720), 120, 0.15)],
)
def test_yunet_alone_finds_the_photographed_face(size, eyes_px, bound, monkeypatch):
    monkeypatch.setenv("GAZERIG_MODELS", str(YUNET_FILE.parent))
    monkeypatch.setattr("gazerig.drivers.vision.face.mtcnn.find_spec", lambda _: None)
    detector = AutoDetector(FaceDetectorParams())
    picture, truth = scene(size, eyes_px)
    for _ in range(6):
        (face,) = detector.find(picture)
        assert landmark_error(face, truth) < bound
    assert "yunet finds the faces" in detector.events()[0]

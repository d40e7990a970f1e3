"""Both detectors find the faces of a world's people."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from posed_people import PosedPeople, look_for, mean_abs_deg, poses, rms_px
from rendering import renders as renders

from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams

pytestmark = pytest.mark.usefixtures("renders")

YUNET_FILE = Path(__file__).parents[3] / "shared" / "models" / "face_detection_yunet_2026may.onnx"
LOOKS = (1, 2, 4, 5)
DETECTORS = {
    "mtcnn": FaceDetectorParams(kind="mtcnn"),
    "yunet": FaceDetectorParams(kind="yunet", model_file=str(YUNET_FILE), work_width_px=640),
}


@pytest.fixture(scope="module")
def people(renders: None) -> Iterator[PosedPeople]:
    made = PosedPeople(LOOKS)
    yield made
    made.close()


@pytest.mark.parametrize("kind", DETECTORS)
def test_faces_of_all_looks_are_found_where_they_are(people: PosedPeople, kind: str) -> None:
    if kind == "yunet" and not YUNET_FILE.exists():
        pytest.skip(f"no {YUNET_FILE}")
    detector = face_detector(DETECTORS[kind])
    every = list(poses(LOOKS, (0.8, 1.6), (-20, 20), 1))
    found = [look_for(people, pose, detector) for pose in every]
    hits = [one for one in found if one is not None]
    assert len(hits) >= 0.95 * len(every)
    assert rms_px(hits) < 5.0
    assert mean_abs_deg([one.yaw_rad for one in hits]) < 8.0
    assert mean_abs_deg([one.pitch_rad for one in hits]) < 8.0


def test_a_posed_face_has_its_landmarks_where_the_picture_has_them(people: PosedPeople) -> None:
    """The iris is darker than the white next to it, at the true places of the pupils."""
    pose = next(poses((5,), (0.7,), (0,), 1))._replace(t_s=0.2, yaw=0.0, pitch=0.0, roll=0.0)
    image = people.show(pose).mean(axis=2)
    for x, y in people.landmarks_px(pose)[:2]:
        column, row = round(x), round(y)
        assert (
            image[row - 1 : row + 2, column - 1 : column + 2].mean()
            < 0.75 * image[row + 14 : row + 17, column - 1 : column + 2].mean()
        )

"""Palms of the nearest person: searched now and then, located by their size, and called hands."""

import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from present import present
from seen_people import HEIGHT, LENS, STILL, WIDTH, face_at
from seen_people import seen as percept_at

from gazerig.drivers.types import DetectedFace, DetectedPalm, DetectedPerson, ImageArray
from gazerig.drivers.vision.body_detector import BodyDetector, add_body_detection
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.litert import anchors
from gazerig.drivers.vision.model_files import FOLDER_VARIABLE, PALMS
from gazerig.drivers.vision.palms import PalmDetector
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.perception import Perception

MODELS = Path(sys.prefix) / "models"
FILM = Path(__file__).parents[4] / "shared" / "media" / "webcam_sign_3.mkv"
ANCHORS = anchors(192, ((8, 2), (16, 6)))
FRAME = np.full((480, 640, 3), 90, np.uint8)
FACE = DetectedFace((300.0, 60.0, 40.0, 65.2), np.zeros((5, 2)), 0.9)
"""Its box is as high as one of a face is at 400 pixels a metre."""
SIDE, LEFT, TOP = 520.0, 60.0, -63.4


class Seen:
    """A network that sees palms at given places of a frame; it counts how often it is run.

    palms: (x, y of the wrist, x, y of the middle finger's root, width, score) in pixels
    """

    def __init__(self, *palms: tuple[float, float, float, float, float, float]) -> None:
        self.palms, self.runs = palms, 0

    def __call__(self, square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert square.shape == (192, 192, 3) and square.min() >= 0.0 and square.max() <= 1.0
        self.runs += 1
        boxes, scores = np.zeros((2016, 18), np.float32), np.full(2016, -9.0, np.float32)
        for row, (x, y, u, v, wide, score) in enumerate(self.palms):
            for again in (0, 1):  # neighbouring anchors see the same palm
                at = 300 + 10 * row + again
                points = np.full((7, 2), 1e3)
                points[[0, 1, 2, 4]] = (x, y), (u - wide / 2, v), (u, v), (u + wide / 2, v)
                spots = (points - (LEFT, TOP) + 0.5) / SIDE - ANCHORS[at]
                boxes[at, 4:] = 192.0 * spots.ravel()
                boxes[at, :2] = boxes[at, 4:6]
                boxes[at, 2:4] = 192.0 * 60.0 / SIDE
                scores[at] = np.log(score / (1.0 - score)) - 0.01 * again
        return boxes, scores


def searched(*palms: tuple[float, float, float, float, float, float]) -> tuple[DetectedPalm, ...]:
    return search(PalmDetector(FaceDetectorParams(), Seen(*palms)), 0.0, (FACE,)) or ()


def search(
    detector: PalmDetector,
    t_s: float,
    faces: tuple[DetectedFace, ...] = (),
    people: tuple[DetectedPerson, ...] = (),
) -> tuple[DetectedPalm, ...] | None:
    return BodyDetector(OneFace(), None, detector).palms(FRAME, t_s, faces, people)


def test_palms_are_found_where_they_are_and_as_large_as_if_they_faced_the_camera():
    first, second = searched((200.0, 300.0, 200.0, 260.0, 10.0, 0.8),
                             (400.0, 300.0, 410.0, 300.0, 30.0, 0.9))  # fmt: skip
    assert first.centre_px == pytest.approx((405.0, 300.0), abs=1.5)
    assert first.size_px == pytest.approx(42.0, abs=0.1) and first.confidence > second.confidence
    assert second.centre_px == pytest.approx((200.0, 280.0), abs=1.5)
    assert second.size_px == pytest.approx(40.0, abs=0.1)


def test_palms_are_searched_so_often_and_while_the_person_is_there():
    network = Seen()
    detector = PalmDetector(FaceDetectorParams(hands_hz=5.0), network)
    assert search(detector, 0.0) is None
    found = [search(detector, 1.0 + i / 30.0, (FACE,) * (i == 0)) for i in range(60)]
    assert [i for i, palms in enumerate(found) if palms is not None] == [0, 6, 12, 18, 24, 30]
    person = DetectedPerson((0.0, 0.0, 9.0, 9.0), (320.0, 92.6), 332.0, 0.9)
    assert search(detector, 9.0, (), (person,)) == () and network.runs == 7


class OneFace:
    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        return (FACE,)


# ---- what perception makes of them ---------------------------------------------------------


def palm_at(p_camera_m: Vec3, confidence: float = 0.9) -> DetectedPalm:
    x, y = project([p_camera_m], LENS)[0].tolist()
    return DetectedPalm((x, y), LENS.fx_px * 0.088 / p_camera_m[2], confidence)


P_FACE: Vec3 = (0.0, 0.0, 1.5)
P_PALM: Vec3 = (0.35, 0.2, 1.1)


def hands(*palms: DetectedPalm, frames: int = 30, depth_m: float | None = None) -> list[Percept]:
    """See a face, and palms in every sixth frame."""
    perception = Perception(STILL, 69.0)
    more = {} if depth_m is None else {"depth_m": np.full((HEIGHT, WIDTH), depth_m, np.float32)}
    return [
        percept_at(
            perception,
            number,
            faces=(face_at(P_FACE),),
            palms=palms if number % 6 == 1 else None,
            **more,
        )  # fmt: skip
        for number in range(1, frames + 1)
    ]


def places(percept: Percept) -> list[Vec3]:
    rows = zip(percept.bodies.kinds, percept.bodies.p_world_m.tolist(), strict=True)
    return [(p[0], p[1], p[2]) for kind, p in rows if kind == "hand"]


def test_a_palm_is_no_farther_than_its_person_unless_it_is_measured():
    (aside,) = places(hands(palm_at((0.6, 0.3, 2.4)), frames=1)[-1])
    assert np.hypot(*aside[:2]) == pytest.approx(1.5, abs=0.02)
    (measured,) = places(hands(palm_at(P_PALM), frames=1, depth_m=0.9)[-1])
    assert measured[0] == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize(
    "palm",
    [palm_at(P_PALM, 0.6), palm_at((0.1, 0.12, 1.5))],  # unsure; a neck
)
def test_what_is_hardly_a_palm_or_on_the_head_is_no_hand(palm):
    assert [places(percept) for percept in hands(palm)] == [[]] * 30


# ---- the network ----------------------------------------------------------------------------


@pytest.mark.skipif(
    not (MODELS / PALMS.file).exists(), reason=f"needs {PALMS.file}: make test fetches it"
)
@pytest.mark.skipif(not FILM.exists(), reason=f"no {FILM}")
def test_the_hands_of_a_person_who_signs_are_found_and_no_elbow(monkeypatch):
    """The one hand is at the forehead, the other before the chest."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(MODELS))
    detector = add_body_detection(OneFace(), FaceDetectorParams(people_hz=0.0, hands_hz=30.0))
    assert isinstance(detector, BodyDetector)
    film, face = cv2.VideoCapture(str(FILM)), replace(FACE, box_px=(276.0, 92.0, 52.0, 64.0))
    for number in range(37):
        assert film.grab()
        if number in (30, 36):
            frame = np.asarray(film.retrieve()[1], np.uint8)
            found = present(detector.palms(frame, float(number), (face,), ()))
            at = sorted(palm.centre_px for palm in found)
            for place, (x, y) in zip(at, ((232.0, 142.0), (353.0, 294.0)), strict=True):
                assert norm(sub((*place, 0.0), (x, y, 0.0))) < 20.0

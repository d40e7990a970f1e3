"""People whose face is not visible: found a part of a frame at a time, tracked, and looked at."""

import pickle
import sys
from collections.abc import Sequence
from math import radians
from pathlib import Path

import numpy as np
import pytest
from present import present
from seen_people import LENS, STILL, face_at
from seen_people import seen as percept_at
from skimage.data import astronaut, cat

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, DetectedPerson, ImageArray, MovingBlob
from gazerig.drivers.vision.body_detector import BodyDetector, add_body_detection
from gazerig.drivers.vision.face.auto import AutoDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.litert import anchors
from gazerig.drivers.vision.model_files import (
    FOLDER_VARIABLE,
    PEOPLE,
)
from gazerig.drivers.vision.palms import PalmDetector
from gazerig.drivers.vision.people import PeopleDetector
from gazerig.gaze.angles import norm
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.dashboard.feed.camera_picture import camera_picture
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception

pytestmark = pytest.mark.usefixtures("still_people_count")
MODELS = Path(sys.prefix) / "models"
NEEDS_NETWORK = pytest.mark.skipif(
    not (MODELS / PEOPLE.file).exists(), reason=f"needs {PEOPLE.file}: make test fetches it"
)
ANCHORS = anchors(224, ((8, 2), (16, 2), (32, 6)))
TRUNK_M = 0.83


class Seen:
    """A network that sees people at given places of a frame; it counts how often it is run.

    people: (head x, head y, trunk, score) in pixels of the frame
    """

    def __init__(self, people: Sequence[tuple[float, float, float, float]], side: float) -> None:
        self.people, self.side = people, side
        self.left_of: list[float] = []
        self.runs = 0

    def __call__(self, square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert square.shape == (224, 224, 3) and square.min() >= -1.0 and square.max() <= 1.0
        left = self.left_of[self.runs % len(self.left_of)]
        self.runs += 1
        boxes, scores = np.zeros((2254, 12), np.float32), np.full(2254, -9.0, np.float32)
        for row, (x, y, trunk, score) in enumerate(self.people):
            for again in (0, 1):  # neighbouring anchors see the same person
                at = 300 + 10 * row + again
                # The face's centre, the size of its box, hips, and the top of the circle.
                head = np.array([x - left, y])
                three = head + [(0.0, 0.1 * trunk), (0.0, 0.9 * trunk), (0.0, -0.1 * trunk)]
                spots = (three + 0.5) / self.side - ANCHORS[at]
                boxes[at, (0, 1, 4, 5, 6, 7)] = 224.0 * spots.ravel()
                boxes[at, 2:4] = 224.0 * 0.5 * trunk / self.side
                scores[at] = np.log(score / (1.0 - score)) - 0.01 * again
        return boxes, scores


def found_in(
    size: tuple[int, int], lefts: list[float], *people: tuple[float, float, float, float]
) -> list[list[DetectedPerson]]:
    """Detections in each square of a frame."""
    network = Seen(people, float(max(size[1], size[0] if len(lefts) == 1 else 0)))
    network.left_of = lefts
    detector = PeopleDetector(FaceDetectorParams(), network)
    frame = np.full((size[1], size[0], 3), 90, np.uint8)
    return [list(detector.find(frame, 0.03 * i)) for i in range(len(lefts))]


# ---- the detector -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "lefts"),
    [((640, 480), [0.0, 160.0]), ((768, 432), [0.0, 168.0, 336.0]), ((480, 640), [-80.0])],
)
def test_people_are_found_where_they_are_in_one_of_the_squares(size, lefts):
    for x in np.linspace(0.1, 0.9, 7) * size[0]:
        one, *again = [p for some in found_in(size, lefts, (x, 90.0, 200.0, 0.9)) for p in some]
        assert len(again) <= 1
        assert one.head_px == pytest.approx((x, 90.0), abs=0.01)
        assert one.trunk_px == pytest.approx(200.0, abs=0.01)
        assert one.confidence == pytest.approx(0.9, abs=1e-3)
        left, top, width, height = one.box_px
        assert left < x < left + width and top == pytest.approx(70.0, abs=0.01)
        assert top + height == pytest.approx(270.0, abs=0.01)


def test_two_people_are_two_and_one_who_is_unsure_or_upside_down_is_none():
    near, far, unsure = (
        (200.0, 90.0, 200.0, 0.9),
        (290.0, 90.0, 150.0, 0.8),
        (60.0, 90.0, 99.0, 0.5),
    )
    left, right = found_in((640, 480), [0.0, 160.0], far, near, unsure)
    assert [p.head_px[0] for p in left] == pytest.approx([200.0, 290.0]) and right == []
    assert found_in((640, 480), [0.0, 160.0], (200.0, 90.0, -200.0, 0.9)) == [[], []]
    assert found_in((640, 480), [0.0, 160.0], (200.0, np.nan, 200.0, 0.9)) == [[], []]


def test_a_square_is_looked_at_in_each_frame_until_the_search_is_done():
    network = Seen((), 432.0)
    network.left_of = [0.0]
    people = PeopleDetector(FaceDetectorParams(people_hz=2.0), network)
    detector = BodyDetector(Faceless(), people)
    frame = np.zeros((432, 768, 3), np.uint8)
    runs = []
    for i in range(33):
        before = network.runs
        detector.find(frame)
        assert detector.people(frame, 10.0 + i / 30.0) == ()
        runs.append(network.runs - before)
    assert runs == [*[1] * 3, *[0] * 12, *[1] * 3, *[0] * 12, *[1] * 3]
    assert people.find(np.zeros((0, 0, 3), np.uint8), 99.0) == ()


class Faceless:
    def find(self, image: ImageArray) -> tuple[()]:
        return ()


def test_frames_carry_people_between_processes():
    network = Seen([(200.0, 90.0, 200.0, 0.9)], 480.0)
    network.left_of = [0.0, 160.0]
    detector = BodyDetector(Faceless(), PeopleDetector(FaceDetectorParams(), network))
    frames = FrameAnalyzer(detector, None, FrameLocator(None, radians(69.0)))
    shown = np.full((480, 640, 3), 90, np.uint8)
    found = frames.analyze(Shot(0.0, 1, shown))
    assert pickle.loads(pickle.dumps(found.people)) == found.people and len(found.people) == 1
    (head,) = present(found.located).faces
    assert head.kind == "face" and head.R_face is None
    assert frames.analyze(Shot(0.03, 2, shown)).people == ()
    lens, level = present(found.located).intrinsics, ((0, 0, 1), (-1, 0, 0), (0, -1, 0))
    picture, jpeg = camera_picture(found, lens, level, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert picture.people[0].head_px == pytest.approx(found.people[0].head_px, abs=0.05)
    assert jpeg[:3] == b"\xff\xd8\xff"
    assert picture.gaze_px == (round(lens.cx_px, 1), round(lens.cy_px, 1))


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    return tmp_path


def test_a_damaged_file_is_told_once_and_faces_are_found(folder):
    PEOPLE.path.write_bytes(b"half of it")
    detector = add_body_detection(Faceless(), FaceDetectorParams())
    assert isinstance(detector, BodyDetector)
    (line,) = detector.events()
    assert "damaged" in line and "gazerig models fetch people" in line
    assert detector.events() == () and detector.find(np.zeros((9, 9, 3), np.uint8)) == ()
    assert detector.people(np.zeros((9, 9, 3), np.uint8), 0.0) == ()
    off = face_detector(FaceDetectorParams(people_hz=0.0, hands_hz=0.0))
    assert isinstance(off, AutoDetector) and off.events() == ()


class Searching:
    """A face detector that searches the whole of every fourth picture."""

    count, searched = 0, False

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        self.searched, self.count = self.count % 4 == 0, self.count + 1
        return (DetectedFace((300.0, 60.0, 40.0, 65.2), np.zeros((5, 2)), 0.9),)


@pytest.mark.parametrize("rate_hz", [8.0, 30.0])
def test_a_picture_gets_two_of_the_three_searches_at_most_and_each_has_its_turn(rate_hz):
    network, runs = Seen((), 480.0), [0]
    network.left_of = [0.0]

    def palms(square: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        runs[0] += 1
        return np.zeros((2016, 18), np.float32), np.full(2016, -9.0, np.float32)

    params, faces = FaceDetectorParams(), Searching()
    detector = BodyDetector(faces, PeopleDetector(params, network), PalmDetector(params, palms))
    frame = np.zeros((480, 640, 3), np.uint8)
    for i in range(round(4.0 * rate_hz)):
        before = network.runs + runs[0]
        found = detector.find(frame)
        people = detector.people(frame, i / rate_hz)
        detector.palms(frame, i / rate_hz, found, people)
        assert network.runs + runs[0] - before + faces.searched <= 2
    assert network.runs >= 8 and runs[0] >= 16


def test_the_doctor_names_what_is_missing(folder, monkeypatch):
    examine_detector = pytest.importorskip("gazerig.features.bringup.cli.doctor").examine_detector
    monkeypatch.setenv("XDG_DATA_HOME", str(folder))
    found = examine_detector(FaceDetectorParams())
    assert found.level == "note" and found.remedy.startswith("gazerig models fetch")


# ---- where they are, and who ---------------------------------------------------------------


def person_at(p_camera_m: Vec3) -> DetectedPerson:
    x, y = project([p_camera_m], LENS)[0].tolist()
    trunk = LENS.fx_px * TRUNK_M / p_camera_m[2]
    return DetectedPerson((x - 50.0, y - 0.1 * trunk, 100.0, trunk), (x, y), trunk, 0.9)


def seeing() -> Perception:
    return Perception(STILL, 69.0)


def at_30_hz(perception: Perception, first: int, count: int, **found: object) -> Percept:
    """See the same in some frames; people are found in every fifteenth alone."""
    people = found.pop("people", ())
    for number in range(first, first + count):
        some = people if number % 15 == 1 else ()
        percept = percept_at(perception, number, people=some, **found)
    return percept


def test_a_person_with_a_visible_face_is_not_there_twice():
    p_m = (0.2, 0.0, 1.5)
    percept = at_30_hz(seeing(), 1, 16, people=(person_at(p_m),), faces=(face_at(p_m),))
    assert len(percept.bodies) == len(percept.faces) == 1
    other = at_30_hz(seeing(), 1, 16, people=(person_at((-0.5, 0.0, 1.5)),), faces=(face_at(p_m),))
    assert len(other.bodies) == 2 and len(other.faces) == 1


def test_a_person_who_turns_away_and_back_stays_the_same():
    perception, p_m = seeing(), (0.2, 0.0, 1.5)
    there = {"people": (person_at(p_m),)}
    (face,) = at_30_hz(perception, 1, 45, **there, faces=(face_at(p_m),)).faces
    assert face.looks_at_head
    # The face was missed but the person is found: it is not gone.
    (missed,) = at_30_hz(perception, 46, 1, **there).faces
    assert missed.id == face.id
    away = at_30_hz(perception, 47, 75, **there)
    assert away.faces == () and away.bodies.ids == (face.id,)
    back = at_30_hz(perception, 122, 15, **there, faces=(face_at(p_m),))
    assert [one.id for one in back.faces] == [face.id] == list(back.bodies.ids)


def test_a_person_who_is_gone_is_reported_for_a_while_only():
    perception = seeing()
    at_30_hz(perception, 1, 31, people=(person_at((0.0, 0.0, 2.0)),))
    assert len(percept_at(perception, 60).bodies) == 1
    assert len(percept_at(perception, 75).bodies) == 0


def test_what_moves_below_the_head_of_a_person_who_is_turned_away_is_theirs():
    legs = MovingBlob(7, "thing", (0.0, 0.84, 2.0), 0.2, v_camera_m_s=(0.1, 0.0, 0.0),
                      depth_known=False, depth_sd_m=1.0)  # fmt: skip
    percept = at_30_hz(seeing(), 1, 40, people=(person_at((0.0, 0.0, 2.0)),), blobs=(legs,))
    assert percept.bodies.kinds == ("face",)
    assert percept.bodies.v_world_m_s[0, 1] == pytest.approx(-0.1, abs=0.03)  # it goes along
    assert "thing" in at_30_hz(seeing(), 1, 20, blobs=(legs,)).bodies.kinds


def test_somebody_who_walks_is_looked_at_at_the_upper_end_and_not_at_the_feet():
    def place(width: float, kind: str = "thing") -> Vec3:
        blob = MovingBlob(1, kind, (0.0, 0.0, 2.0), 0.3, depth_known=False, depth_sd_m=1.0,
                          box_px=(320.0 - width / 2, 100.0, width, 200.0),
                          area_px=100.0 * width)  # fmt: skip
        percept = percept_at(seeing(), 1, blobs=(blob,))
        x, y, z = percept.bodies.p_world_m[0].tolist()
        return x, y, z

    x, _, z = place(100.0)
    ray = (100.0 + 200.0 / 14.0 - LENS.cy_px) / LENS.fy_px
    assert z / x == pytest.approx(-ray, abs=1e-3) and norm((x, 0.0, z)) == pytest.approx(2.0)
    assert place(190.0)[2] == place(100.0, "hand")[2] == pytest.approx(0.0)


# ---- the network ----------------------------------------------------------------------------


@NEEDS_NETWORK
def test_a_photographed_person_is_found_and_a_cat_is_none(monkeypatch):
    monkeypatch.setenv(FOLDER_VARIABLE, str(MODELS))
    detector = add_body_detection(Faceless(), FaceDetectorParams(people_hz=30.0))
    assert isinstance(detector, BodyDetector)
    (person,) = detector.people(astronaut()[:, :, ::-1].copy(), 0.0)
    assert person.head_px == pytest.approx((225.0, 100.0), abs=15.0)
    assert not any(detector.people(cat()[:, :, ::-1].copy(), 1.0 + i) for i in range(2))

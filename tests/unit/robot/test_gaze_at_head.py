"""Whether a person looks at the head: from landmarks and eyes to page, recording and attention."""

from dataclasses import replace
from math import atan2, degrees, hypot, pi, radians

import numpy as np
import pytest
from attention_scene import attention, looking
from fakes.scenes import EmptyScene
from posed_faces import CAMERA, image_of, turned
from seen_people import AT_EYES, standing

from gazerig.drivers.camera.capture_loop import FrameAnalyzer, is_off_frame
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, Detections
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import PARTS, Angles2, Bodies, Face, Percept, Vec3
from gazerig.robot.perception.face_pose import face_pose
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.track import looks_at_head
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import ScenePerson

LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Turning(EmptyScene):
    """A scene of one person whose face is turned off the head by a function of the time."""

    def __init__(self, away_m: float, off_deg: float, aside_m: float = 0.0) -> None:
        self._p, self._off = (away_m, aside_m, 0.05), radians(off_deg)

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        x, y, z = self._p
        way: Angles2 = (atan2(-y, -x) + self._off, atan2(-z, hypot(x, y)))
        return (ScenePerson(self._p, way, None),)


def found(scene: Turning, seconds: float) -> list[Face]:
    """Return the face as perceived, once a frame, after half a second."""
    camera = SceneCamera(
        FrameParams(),
        scene,
        AT_EYES,
        lambda _: (LEVEL, (0.0, 0.0, 0.0)),
        np.random.default_rng(0),
    )
    camera.open()
    perception = Perception(AT_EYES, 69.0)
    out, number = [], 0
    for k in range(round(30 * seconds)):
        seen = camera.latest(k / 30 + 0.001)
        percept = perception.see(seen, standing())
        if seen is not None and seen.number != number and percept is not None and percept.faces:
            number = seen.number
            if k > 15:
                out.append(percept.faces[0])
    return out


@pytest.mark.parametrize(
    ("away_m", "off_deg", "looks"),
    [(1.2, 0, True), (0.7, 5, True), (2.5, 5, True), (0.7, 20, False), (1.2, -15, False),
     (2.5, -15, False), (1.2, -30, False)],
)  # fmt: skip
def test_e77_a_person_who_looks_at_the_head_is_known(away_m, off_deg, looks):
    each = found(Turning(away_m, off_deg, 0.1), 8.0)
    assert len(each) > 200
    assert np.mean([face.looks_at_head is looks for face in each]) >= 0.95
    off = [degrees(face.off_head_rad or 0.0) for face in each]
    assert np.median(off) == pytest.approx(abs(off_deg), abs=6.0)


@pytest.mark.parametrize("off_deg", [8.0, 12.0])
def test_e77_on_the_edge_the_answer_does_not_flicker(off_deg):
    each = [face.looks_at_head for face in found(Turning(1.2, off_deg), 30.0)]
    changes = sum(a != b for a, b in zip(each, each[1:], strict=False))
    assert changes <= 30


def test_what_was_found_before_stays_between_the_edges():
    sd = radians(4.0)
    for off_deg, before, looks in [
        (7.9, None, True), (7.9, False, True), (8.1, False, False), (8.1, None, False),
        (8.1, True, True), (11.9, True, True), (12.1, True, False),
    ]:  # fmt: skip
        assert looks_at_head(radians(off_deg), sd, False, before) is looks
    # A less certain turn needs more to change the answer; an unknown one has no effect.
    assert looks_at_head(radians(7.9), radians(14.0), False, False) is False
    assert looks_at_head(radians(12.1), radians(14.0), False, True) is True
    assert looks_at_head(0.0, radians(16.8), False, True) is None


@pytest.mark.parametrize("away_m", [0.7, 1.5, 3.0])
def test_the_deviation_of_a_turn_is_that_of_landmarks_with_their_usual_errors(away_m):
    rng, R, p = np.random.default_rng(2), turned(0.0, 0.0, 0.0), np.array((0.0, 0.0, away_m))
    exact = image_of(R, p)
    eyes_px = float(np.linalg.norm(exact[0] - exact[1]))
    yaws, told = [], 0.0
    for _ in range(300):
        noise = rng.normal(0.0, 1.0, (5, 2)) * hypot(1.0, 0.04 * eyes_px)
        pose = face_pose(exact + noise, CAMERA)
        if pose is not None:
            ahead = np.array(pose.R_camera_face)[:, 0]
            yaws.append(atan2(ahead[0], -ahead[2]))
            told = pose.turn_sd_rad
    assert 0.6 < np.std(yaws) / told < 1.4


def detection(gaze: Vec3 | None) -> Detections:
    pixels = image_of(turned(radians(30.0), 0.0, 0.0), np.array((0.0, 0.0, 1.0)))
    face = DetectedFace((250.0, 150.0, 120.0, 120.0), pixels, 0.9, gaze)
    return Detections(1.0, 1, 640, 480, (face,), lens=CAMERA)


@pytest.mark.parametrize(
    ("gaze", "looks"), [(None, False), ((0.0, 0.0, -1.0), True), ((0.3, 0.0, -0.95), False)]
)
def test_the_eyes_go_before_the_face(gaze, looks):
    percept = Perception(AT_EYES, 65.0).see(detection(gaze), standing())
    assert percept is not None
    (face,) = percept.faces
    assert face.looks_at_head is looks
    if gaze is None:
        assert face.gaze_world is None and degrees(face.off_head_rad or 0.0) > 20.0
    else:  # out of the image is back along the world's x
        assert face.gaze_world == pytest.approx((gaze[2], -gaze[0], -gaze[1]))


def face_at(id: int, p: Vec3, looks: bool | None) -> Face:
    R = rotation((pi, 0.0, 0.0))
    return Face(id, p, (0.0, 0.0, 0.0), R, (p,) * len(PARTS), 0.9, "", 0.0, 0.2, looks)


def percept_of(t_s: float, *rows: Face) -> Percept:
    n = len(rows)
    still = np.zeros((n, 3))
    places = np.array([face.p_world_m for face in rows])
    ids = tuple(face.id for face in rows)
    return Percept(t_s, Bodies(ids, ("face",) * n, places, still, still, np.full(n, 0.1)), rows)


@pytest.mark.parametrize(
    ("social", "looked_at"), [("people", [(2,), (1,)]), ("none", [(1, 2), (1, 2)])]
)
def test_of_two_faces_the_one_that_looks_at_the_head_gets_more(social, looked_at):
    left, right = (1.0, 0.2, 0.0), (1.0, -0.2, 0.0)
    for (one, other), first in zip([(False, True), (True, False)], looked_at, strict=True):
        model = attention(social=social)
        looks = [
            model.choose(
                percept_of(k / 30, face_at(1, left, one), face_at(2, right, other)),
                looking(),
                k / 30,
            )
            for k in range(900)
        ]
        assert looks[0].id in first
        shares = [np.mean([look.id == id for look in looks]) for id in (1, 2)]
        assert min(shares) > 0.2  # both are looked at
        if len(first) == 1:
            assert shares[first[0] - 1] > 0.55
        # The rule's whole constant is kept for the face that wins it.
        assert {look.salience for look in looks} == {0.5}
    unsure = model.choose(percept_of(99.0, face_at(1, left, None)), looking(), 99.0)
    assert unsure.saliences[0].total == pytest.approx(0.5)


# ---- Landmarks outside the picture: reported once, and the gaze continues without such a face.


PIXELS = image_of(turned(0.1, 0.0, 0.0), np.array((0.0, 0.0, 0.8)))
FACE = DetectedFace((290.0, 200.0, 80.0, 80.0), PIXELS, 0.9)
# As a detector gives it that was made for frames of three times the size.
OFF = replace(FACE, landmarks_px=3.0 * PIXELS)


def test_one_point_far_outside_is_no_face():
    points = PIXELS.copy()
    points[4] = (5000.0, 200.0)
    assert is_off_frame(replace(FACE, landmarks_px=points), 640, 480)
    assert not is_off_frame(FACE, 640, 480)


def test_the_others_are_looked_at():
    perception = Perception(AT_EYES, 65.0)
    percept = perception.see(Detections(1.0, 1, 640, 480, (OFF, FACE), lens=CAMERA), standing())
    assert percept is not None and len(percept.faces) == 1
    none = perception.see(Detections(9.0, 2, 640, 480, (OFF,), lens=CAMERA), standing())
    assert none is not None and none.faces == ()


def test_it_is_left_out_by_the_process_of_the_camera():
    class Detector:
        def find(self, image: object) -> tuple[DetectedFace, ...]:
            return (FACE, OFF)

    image = np.zeros((480, 640, 3), np.uint8)
    (seen,) = FrameAnalyzer(Detector()).analyze(Shot(0.1, 1, image)).faces
    assert np.array_equal(seen.landmarks_px, PIXELS)

"""Hands from pixels: what moves otherwise than a person, within reach; and whose hand waves."""

from collections.abc import Iterator
from math import degrees, dist, radians
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from fakes.scenes import EmptyScene
from present import present
from text_table import rows

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.types import Located
from gazerig.gaze.angles import add, angle_between, rotation, sub
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.hands import HAND, Hands, Known, known_faces, without_own_motion
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.robot.perception.perception import Perception
from gazerig.robot.run.surroundings import load_scene
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.cameras.rendered import PixelCamera
from gazerig.sim_mock.scenes.faces_scene import HEAD_M
from gazerig.sim_mock.scenes.scene import Scene, ScenePerson


class Later(EmptyScene):
    """A scene that begins at another time."""

    def __init__(self, scene: Scene, start_s: float) -> None:
        self.name, self._scene, self._start_s = scene.name, scene, start_s

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the people."""
        return self._scene.people(t_s + self._start_s)


class Frame(NamedTuple):
    """What perception makes of a frame; hand: the true place of the first one, if there is one."""

    t_s: float
    percept: Percept
    hand: Vec3 | None

    def seen(self, kind: str) -> dict[int, Vec3]:
        """Return the places of the bodies of a kind."""
        bodies = self.percept.bodies
        rows = zip(bodies.ids, bodies.kinds, bodies.p_world_m.tolist(), strict=True)
        return {id: p for id, one, p in rows if one == kind}


def frames(scene: Scene, start_s: float, end_s: float) -> Iterator[Frame]:
    """Yield what perception makes of drawn frames of a part of a scene; the neck is still."""
    later = Later(scene, start_s)
    rig, faces = load_rig("desk"), SimpleNamespace(found=())
    mount, rng = CameraMount(rig.camera), np.random.default_rng(0)
    detector: Any = SimpleNamespace(find=lambda image: faces.found)  # true faces, drawn hands
    head = rotation((0.0, 0.0, 0.0)), HEAD_M
    field = rig.camera.horizontal_field_deg
    drawn = FrameParams(latency_ms=0.0, horizontal_field_deg=field)
    truth = SceneCamera(FrameParams(latency_ms=0.0), later, mount, lambda t_s: head, rng)
    truth.open()
    turns, locate = PoseBuffer(), FrameLocator(None, radians(field))
    motion = MotionSource(rig.motion, None, radians(field), turns)
    camera = PixelCamera(
        drawn, DrawnScene(later), mount, lambda t_s: head, detector, rng, motion, locate
    )
    perception = Perception(mount, field)
    neck: Any = SimpleNamespace(head_pose=lambda head_rad: head)
    poses = PoseHistory(neck)
    for number in range(round(30.0 * (end_s - start_s))):
        t_s = number / 30.0 + 1e-6
        turns.record(t_s, mount.rotation(head[0]))
        poses.remember(t_s, (0.0, 0.0, 0.0))
        found = truth.latest(t_s)
        faces.found = found.faces if found is not None else ()
        hands = (person.hand for person in later.people(t_s))
        percept = present(perception.see(camera.latest(t_s), poses))
        yield Frame(
            start_s + t_s, percept, next((hand for hand in hands if hand is not None), None)
        )


def off_deg(a: Vec3, b: Vec3) -> float:
    """Return the angle between two places as seen from the head."""
    return degrees(angle_between(sub(a, HEAD_M), sub(b, HEAD_M)))


EYE: Vec3 = (0.0, 0.0, 0.0)
FACE: Known = ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
OTHER: Known = ((1.6, 0.75, 0.0), (0.0, 0.0, 0.0))
BESIDE: Vec3 = (2.0, 0.7, -0.2)
"""Where a patch beside the face of FACE is believed, its distance being assumed."""


def patch(p: Vec3 = BESIDE, v: Vec3 = (0.0, 1.2, 0.0), radius_m: float = 0.25, mark: int = 7,
          **more: object) -> Located:  # fmt: skip
    made = Located("thing", p, None, radius_m, 0.0, 1.0, v_m_s=v, detector_id=mark)
    return made._replace(**{"fastest_m": p, "fastest_m_s": v, **more})  # type: ignore[arg-type]


def level(p: Vec3) -> float:
    """Return how far away a place is, its height apart."""
    return dist(p[:2], EYE[:2])


def kinds(hands: Hands, *seen: Located, faces: tuple[Known, ...] = (FACE,)) -> list[str]:
    """Return what the patches of successive frames are called, by a camera that is elsewhere."""
    there = (0.5, -0.25, 2.0)
    people: list[Known] = [(add(p, there), v) for p, v in faces]
    moved = [
        one._replace(p_m=add(one.p_m, there), fastest_m=add(one.fastest_m or one.p_m, there))
        for one in seen
    ]
    return [hands.label([one], people, there, k / 30)[0].kind for k, one in enumerate(moved)]


ARMS = """
# Tip aside and above of the face; the end of the arm's line, at the shoulder 0.19 -0.17; speed
# aside of the tip, of the middle, and of the face; radius; whether it is a hand
0.6  -0.17   0.19 -0.17   1.2   1.2  0    0.1    1
0.84  0      0.19 -0.17   1.2   1.2  0    0.1    1  # within reach
0.86  0      0.19 -0.17   1.2   1.2  0    0.1    0
0.3   0.69   0.19 -0.17   1.2   1.2  0    0.1    1
0.3   0.71   0.19 -0.17   1.2   1.2  0    0.1    0
0.2  -0.79   0.19 -0.17   1.2   1.2  0    0.1    1
0.2  -0.81   0.19 -0.17   1.2   1.2  0    0.1    0
0.5   0.7    0.19 -0.17   1.2   1.2  0    0.1    0
0.5   0.68   0.19 -0.17   1.2   1.2  0    0.1    1
0.6  -0.17   0.45 -0.17   1.2   1.2  0    0.1    1  # at the shoulder
0.6  -0.17   0.47 -0.17   1.2   1.2  0    0.1    0
0.6  -0.17   0.19  0.09   1.2   1.2  0    0.1    1
0.6  -0.17   0.19  0.11   1.2   1.2  0    0.1    0
0.6  -0.17   0.19 -0.43   1.2   1.2  0    0.1    1
0.6  -0.17   0.19 -0.45   1.2   1.2  0    0.1    0
0.6  -0.17   0.19 -0.17   0.41  0.2  0    0.1    1  # in motion
0.6  -0.17   0.19 -0.17   0.39  0.2  0    0.1    0
0.6  -0.17   0.19 -0.17   -0.41 0.2  0    0.1    1
0.6  -0.17   0.19 -0.17   1.2   1    0.7  0.1    0  # not faster than who walks
0.6  -0.17   0.19 -0.17   1.2   1    0.55 0.1    1
0.6  -0.17   0.19 -0.17   1.2   1    -0.7 0.1    1
0.6  -0.17   0.19 -0.17   1.2   1.27 0    0.1    0  # fastest at its end
0.6  -0.17   0.19 -0.17   1.2   1.25 0    0.1    1
0.2   0.1    0.19 -0.17   1.49  1.4  0    0.1    0  # before the head
0.2   0.1    0.19 -0.17   1.57  1.4  0    0.1    1
0.26  0      0.19 -0.17   1.2   1.2  0    0.1    1
0.6  -0.17   0.19 -0.17   1.2   1.2  0    0.239  1  # of an arm's size
0.6  -0.17   0.19 -0.17   1.2   1.2  0    0.241  0
0.6  -0.17   0.19 -0.17   1.2   1.2  0    0.041  1
0.6  -0.17   0.19 -0.17   1.2   1.2  0    0.039  0
"""


@pytest.mark.parametrize("row", rows(ARMS))
def test_an_arm_that_moves_within_reach_is_a_hand_from_the_second_frame_on(row):
    aside, up, end, height, tip_m_s, middle_m_s, face_m_s, radius_m, is_hand = row
    # Its speed counts across the view: to the side, seen from aside, by less.
    tip, middle = (1.0, aside, up), (1.0, 0.5 * (aside + end), 0.5 * (up + height))
    seen = patch(middle, (0.0, middle_m_s, 0.0), radius_m, fastest_m=tip, depth_measured=True)
    toward = np.hypot(1.0, up) / np.sqrt(1.0 + aside**2 + up**2)
    seen = seen._replace(
        fastest_m_s=(0.0, tip_m_s / toward, 0.0), v_m_s=(0.0, middle_m_s / toward, 0.0)
    )
    walks: Known = (FACE[0], (0.0, face_m_s / toward, 0.0))
    assert kinds(Hands(), *[seen] * 3, faces=(walks,)) == [
        "thing",
        *[HAND if is_hand else "thing"] * 2,
    ]


def test_what_is_known_or_nobodys_is_no_hand():
    assert HAND not in kinds(Hands(), *[patch(mark=3, kind="ball")] * 5)
    assert HAND not in kinds(Hands(), *[patch()._replace(detector_id=None)] * 5)
    assert HAND not in kinds(Hands(), *[patch()] * 5, faces=())


def test_a_hand_remains_one_where_it_turns_or_passes_before_the_face_and_not_for_long():
    before, rests = patch(p=(2.0, 0.1, 0.1)), patch(v=(0.0, 0.05, 0.0))
    seen = [patch()] * 3 + [rests] * 6 + [before] * 3 + [rests] * 30
    assert set(kinds(Hands(), *seen)[1:12]) == {HAND}
    assert kinds(Hands(), *seen)[-1] == "thing"


@pytest.mark.parametrize(("last_m_s", "stays"), [(0.1, True), (1.2, False)])
def test_a_hand_that_has_come_to_rest_is_still_there_and_one_that_went_is_not(last_m_s, stays):
    hands, there = Hands(), []
    for k in range(90):
        speed = 1.2 if k < 10 else last_m_s
        seen = [patch(v=(0.0, speed, 0.0))] if k < 12 else []
        there.append([(one.kind, one.v_m_s) for one in hands.label(seen, [FACE], EYE, k / 30)])
    assert there[11][0][0] == HAND
    assert there[12:71] == [[(HAND, (0.0, 0.0, 0.0))] if stays else []] * 59
    assert there[-1] == [] and not hands.resting


def test_between_two_people_the_arm_tells_whose_hand_it_is_and_it_stays_theirs():
    """The fastest part is in the middle between both; the patch goes on to the one or the other."""
    tip = (2.0, 0.62, -0.3)
    for side, face in ((0.2, OTHER), (-0.2, FACE)):
        hands = Hands()
        seen = patch(p=(2.0, 0.62 + side, -0.4), fastest_m=tip)
        for k in range(3):
            (found,) = hands.label([seen], [FACE, OTHER], EYE, k / 30)
        assert level(found.p_m) == pytest.approx(level(face[0]))
        (found,) = hands.label([patch(p=tip)], [FACE, OTHER], EYE, 0.1)
        assert level(found.p_m) == pytest.approx(level(face[0]))


def test_e91_a_waving_hand_is_found_from_pixels_and_whose_it_is():
    """The one on the right of three waves from 21.5 s on, the hand before the one in the middle."""
    persons, named, off, faces = Persons(), [], [], {}
    for frame in frames(load_scene("three-people"), 21.2, 23.7):
        persons.update(frame.percept, HEAD_M)
        hands = frame.seen(HAND)
        if frame.t_s > 22.2:
            named.append(persons.ids_with_trait("waving"))
            true = present(frame.hand)
            off.append(min([off_deg(p, true) for p in hands.values()], default=90.0))
            faces = frame.seen("face")
    assert np.median(off) < 5.0 and np.percentile(off, 90) < 9.0
    right = min(faces, key=lambda id: faces[id][1])
    assert set(named) == {frozenset((right,))}


@pytest.mark.parametrize(("scene", "start_s"), [("walks-past", 5.2), ("sits-still", 0.0)])
def test_e92_who_walks_by_or_sits_still_has_no_hands(scene, start_s):
    for frame in frames(load_scene(scene), start_s, start_s + 2.0):
        assert frame.seen(HAND) == {}


def coming(growth_1_s: float, sd_1_s: float = 0.3, radius_m: float = 0.2) -> Located:
    """Return a patch at 2 m that grows at this rate and hardly moves across the view."""
    way = np.array(BESIDE)
    far = float(np.linalg.norm(way))
    x, y, z = (-growth_1_s * way).tolist()
    return patch(v=(x, y, z), radius_m=radius_m, along_sd_m_s=sd_1_s * far)


@pytest.mark.parametrize(
    ("seen", "first"),
    [(coming(5.0), HAND), (coming(2.0), "thing"), (coming(5.0, sd_1_s=2.0), "thing"),
     (coming(5.0, radius_m=0.05), "thing")],
)  # fmt: skip
def test_what_comes_at_the_camera_is_a_hand_at_once(seen, first):
    assert kinds(Hands(), seen)[0] == first


FIST: Located = patch(radius_m=0.13 * 2.0, compact=True)
"""Too large for a hand at the person's distance of 1 m."""


def test_what_is_too_large_for_a_hand_at_the_persons_distance_is_as_near_as_makes_it_one():
    hands, far = Hands(), []
    for k in range(8):  # then it is drawn back, or goes on as an arm
        seen = FIST if k < 4 else patch(radius_m=0.2)
        (found,) = hands.label([seen], [FACE], EYE, k / 30)
        far.append(level(found.p_m))
        assert found.v_m_s == pytest.approx((0.0, 1.2 * far[-1] / level(FIST.p_m), 0.0)) or k == 0
    near = 0.065 / (0.26 / level(FIST.p_m))  # of its size, as far away as the person
    left = 1.0 - near
    assert far[1:] == pytest.approx(
        [near, near, near, 1.0 - left / 2, 1.0 - left / 4, 1.0 - left / 8, 1.0 - left / 16]
    )


def reaching(wide_m: float, **more: object) -> Located:
    """Return an arm from aside, as wide as given if it were as far away as the person of FACE."""
    said = {"from_side": True, "p": (2.0, 1.1, -0.2), "fastest_m": BESIDE} | more
    return patch(thickness_m=2.1 * wide_m, **said)  # type: ignore[arg-type]


def test_an_arm_that_comes_in_at_the_side_is_as_near_as_makes_it_as_wide_as_a_hand():
    hands, exact = Hands(), level(BESIDE) / 2.1
    seen = [reaching(0.17), reaching(0.34), reaching(0.17), reaching(0.06), reaching(0.25)]
    away = [level(hands.label([one], [FACE], EYE, k / 30)[0].p_m) for k, one in enumerate(seen)]
    mean = [(0.5 + 0.25) / 2, *[(0.5 + 0.25 + 0.5) / 3] * 3]
    assert away[1:] == pytest.approx([exact * one for one in mean])
    own = Hands()
    for k in range(6):
        (hand,) = own.label([reaching(0.17, p=(2.0, 0.5, -0.2))], [FACE], EYE, k / 30)
    assert level(hand.p_m) == pytest.approx(1.0)  # from the person's own shoulder
    for wide_m, side in ((0.118, True), (0.17, False)):  # not as wide, or not at the side
        inside = Hands()
        for k in range(3):
            (arm,) = inside.label([reaching(wide_m, from_side=side)], [FACE], EYE, k / 30)
        assert arm.kind == "thing"


BODIES = """
# Aside of the face, 20 m away, and above it; how much deeper; whether that is measured; speed
# aside of the patch and of the face; whether it is a part of the person, and on the head
0.249  0      0     1  9     0     1 1  # on the head
-0.249 0      0     1  9     0     1 1
0      0.249  0     1  9     0     1 1
0.251  0      0     1  9     0     0 0
0.251  0      0     1  0     0     1 0
0.349  0      0     1  0     0     1 0  # on the body
0.351  0      0     1  0     0     0 0
0      -1.69  0     1  0     0     1 0
0      -1.71  0     1  0     0     0 0
0.1    0.24   0     1  0     0     1 0
0.1    0.26   0     1  0     0     0 0
0      0      0.69  1  9     0     1 1  # at its depth
0      0      0.71  1  9     0     0 0
0      0      -0.71 1  9     0     0 0
0      0      -10   0  9     0     1 1
0      -1     0     1  0.29  0     1 0  # moves as it does
0      -1     0     1  0.31  0     0 0
0      -1     0     1  -0.31 0     0 0
0      -1     0     1  0.51  1     1 0
0      -1     0     1  0.49  1     0 0
0      -1     0     1  1.51  1     0 0
0      -1     -10   0  0.145 0     1 0
0      -1     -10   0  0.155 0     0 0
0      -1     0     1  none  0     1 0
0      -1     0     1  9     none  1 0
"""


@pytest.mark.parametrize("row", rows(BODIES))
def test_what_moves_on_the_body_of_a_person_is_theirs(row):
    aside, up, deeper, measured, v, v_face, own, on_head = row
    turn, lift, far = 2.0 * np.arcsin(aside / 40.0), np.arcsin(up / 20.0), 20.0 + deeper
    way = np.cos(lift) * np.cos(turn), np.cos(lift) * np.sin(turn), np.sin(lift)
    speeds = [None if one == "none" else (0.0, one, 0.0) for one in (v, v_face)]
    thing = Located("thing", tuple(far * np.array(way)), None, 0.1, -2.0, along_sd_m=0.1)
    thing = thing._replace(v_m_s=speeds[0], depth_measured=bool(measured))
    face = Located("face", (20.0, 0.0, 0.0), None, 0.1)
    known: list[Known] = [((0.0, 9.0, 0.0), None), (face.p_m, speeds[1])]
    other = face._replace(p_m=known[0][0])
    turned, others, carried = without_own_motion([other, face], [thing], known, EYE)
    assert turned == [other, face._replace(spin_rad_s=-2.0 * on_head)]
    assert (others, carried) == ([] if own else [thing], [])
    assert without_own_motion([other], [thing], known, EYE)[2] == [(0, thing)] * int(own)
    hand = thing._replace(kind=HAND)
    assert without_own_motion([other, face], [hand], known, EYE)[1] == [hand]


def test_a_face_has_the_velocity_of_its_track():
    face = Located("face", (2.0, 0.0, 0.0), None, 0.1)
    moves: Vec3 = (1.0, 2.0, 3.0)
    for away, v in ((0.24, moves), (0.26, None)):
        tracked: list[Known] = [((2.0, 1.0, 0.0), EYE), ((2.0, 0.0, away), moves)]
        assert known_faces([face], tracked) == [(face.p_m, v), *tracked]

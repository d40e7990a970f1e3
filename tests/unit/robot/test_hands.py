"""Hands from pixels: what moves otherwise than a person, within reach; and whose hand waves."""

from collections.abc import Iterator
from math import degrees, dist, radians
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from fakes.scenes import EmptyScene
from present import present

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.types import Located
from gazerig.gaze.angles import angle_between, rotation, sub
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.hands import HAND, Hands, Known
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
    """Return what the patches of successive frames are called."""
    return [hands.label([one], list(faces), EYE, k / 30)[0].kind for k, one in enumerate(seen)]


def test_what_moves_within_reach_is_a_hand_from_the_second_frame_on():
    assert kinds(Hands(), *[patch()] * 3) == ["thing", HAND, HAND]


@pytest.mark.parametrize(
    "seen",
    [patch(v=(0.0, 0.6, 0.0)), patch(p=(2.0, 2.4, 0.0)), patch(p=(2.0, 0.5, -1.9)),
     patch(radius_m=0.6), patch(mark=3, kind="ball"), patch(p=(2.0, 0.1, 0.1)),
     patch(p=(3.4, 0.7, -0.2), depth_measured=True, along_sd_m=0.02)],
    # hardly moves, out of reach, a leg, a person who passes, something known, a head that turns,
    # measured far behind
)  # fmt: skip
def test_what_is_no_hand_is_none(seen: Located):
    assert HAND not in kinds(Hands(), *[seen] * 5)
    assert HAND not in kinds(Hands(), *[patch()._replace(detector_id=None)] * 5)
    assert HAND not in kinds(Hands(), *[patch()] * 5, faces=())


def led(tip: Vec3, middle: Vec3, **more: object) -> Located:
    """Return a patch that is fastest at its tip."""
    return patch(p=middle, fastest_m=tip, **more)  # type: ignore[arg-type]


CURTAIN = led((2.0, 1.3, 0.1), (2.0, 1.5, -0.1), radius_m=0.45, thickness_m=0.5)


@pytest.mark.parametrize(
    "seen",
    [CURTAIN, led((2.0, 1.1, -0.9), (2.0, 0.9, -0.2)), led((2.0, 0.4, -0.4), (2.0, 0.9, -0.9)),
     patch(radius_m=0.08)],
    # a curtain, a thing aside, an elbow, too small for an arm
)  # fmt: skip
def test_what_moves_within_reach_is_a_thing_without_evidence_of_a_hand(
    seen: Located,
):
    assert kinds(Hands(), *[seen] * 6) == ["thing"] * 6


def test_the_legs_of_somebody_who_walks_are_no_hands_and_a_wave_while_walking_is():
    walks: Known = (FACE[0], (0.0, 1.0, 0.0))
    assert HAND not in kinds(Hands(), *[patch(v=(0.0, 0.4, 0.0))] * 4, faces=(walks,))
    assert HAND in kinds(Hands(), *[patch(v=(0.0, -1.6, 0.0))] * 4, faces=(walks,))


def test_a_hand_remains_one_where_it_turns_or_passes_before_the_face_and_not_for_long():
    before, rests = patch(p=(2.0, 0.1, 0.1)), patch(v=(0.0, 0.05, 0.0))
    seen = [patch()] * 3 + [rests] * 6 + [before] * 3 + [rests] * 30
    assert set(kinds(Hands(), *seen)[1:12]) == {HAND}
    assert kinds(Hands(), *seen)[-1] == "thing"


@pytest.mark.parametrize(("last_m_s", "stays"), [(0.1, True), (1.2, False)])
def test_a_hand_that_has_come_to_rest_is_still_there_and_one_that_went_is_not(
    last_m_s: float, stays: bool
):
    hands, there = Hands(), []
    for k in range(90):
        speed = 1.2 if k < 10 else last_m_s
        seen = [patch(v=(0.0, speed, 0.0))] if k < 12 else []
        there.append([(one.kind, one.v_m_s) for one in hands.label(seen, [FACE], EYE, k / 30)])
    assert there[11][0][0] == HAND
    assert there[12:71] == [[(HAND, (0.0, 0.0, 0.0))] if stays else []] * 59
    assert there[-1] == [] and not hands.resting


def test_a_hand_is_as_far_as_the_person_unless_its_distance_is_measured():
    for measured, far in ((False, 1.0), (True, 0.62)):
        p: Vec3 = (0.6, 0.15, -0.05) if measured else (2.0, 0.5, -0.2)
        hands, seen = Hands(), patch(p=p, depth_measured=measured, along_sd_m=0.02)
        for k in range(3):
            (found,) = hands.label([seen], [FACE], EYE, k / 30)
        assert level(found.p_m) == pytest.approx(far, abs=0.01)
        assert found.v_m_s is not None
        assert found.v_m_s[1] == pytest.approx(1.2 * dist(found.p_m, EYE) / dist(p, EYE))


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
def test_e92_who_walks_by_or_sits_still_has_no_hands(scene: str, start_s: float):
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
def test_what_comes_at_the_camera_is_a_hand_at_once(seen: Located, first: str):
    assert kinds(Hands(), seen)[0] == first


FIST: Located = patch(radius_m=0.13 * 2.0, compact=True)
"""Too large for a hand at the person's distance of 1 m."""


def test_what_is_too_large_for_a_hand_at_the_persons_distance_is_as_near_as_makes_it_one():
    hands, far = Hands(), []
    for k in range(12):
        (found,) = hands.label([FIST._replace(radius_m=0.26 + 0.01 * k)], [FACE], EYE, k / 30)
        far.append(level(found.p_m))
    size_m = (0.26 + 0.11) * 1.0 / level(FIST.p_m)  # as far away as the person
    assert far[-1] == pytest.approx(0.065 / size_m, rel=0.1)
    assert far[-1] < 0.45 and found.v_m_s is not None
    assert found.v_m_s[1] == pytest.approx(1.2 * far[-1] / level(FIST.p_m))
    # A hand that is drawn back, or goes on as an arm, is at the person's distance again.
    for k in range(12, 20):
        (found,) = hands.label([patch(radius_m=0.2)], [FACE], EYE, k / 30)
    assert level(found.p_m) == pytest.approx(1.0, abs=0.02)


def reaching(wide_m: float, **more: object) -> Located:
    """Return an arm from aside, as wide as given if it were as far away as the person of FACE."""
    said = {"from_side": True, "p": (2.0, 1.1, -0.2), "fastest_m": BESIDE} | more
    return patch(thickness_m=2.1 * wide_m, **said)  # type: ignore[arg-type]


def test_an_arm_that_comes_in_at_the_side_is_as_near_as_makes_it_as_wide_as_a_hand():
    hands = Hands()
    seen = [reaching(0.17)] * 3 + [reaching(0.06)] * 3 + [reaching(0.25)] * 2
    away = [level(hands.label([one], [FACE], EYE, k / 30)[0].p_m) for k, one in enumerate(seen)]
    assert away[1:] == pytest.approx([0.5] * 7, abs=0.03), "and stays there as less of it moves"
    own = Hands()
    for k in range(6):
        (hand,) = own.label([reaching(0.17, p=(2.0, 0.5, -0.2))], [FACE], EYE, k / 30)
    assert level(hand.p_m) == pytest.approx(1.0, abs=0.03)  # from the person's own shoulder

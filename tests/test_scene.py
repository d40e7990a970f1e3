"""The scenes: closed forms that move as people can, and the events they ask about."""

from math import atan2, degrees, dist, hypot
from pathlib import Path

import numpy as np
import pytest

from gazerig.config.faults import ConfigError
from gazerig.gaze.types import Vec3
from gazerig.robot.app.scene_files import load_scene, scene_names
from gazerig.sim_mock.scenes.faces_scene import HEAD_M
from gazerig.sim_mock.scenes.scene import Event, Scene, Thing, there_and_back
from gazerig.sim_mock.scenes.timeline import HALF_FIELD_RAD

NAMES = (
    "boxing", "face-to-face", "interview", "sits-still", "steps-aside", "table", "three-people",
    "two-people", "visitor",
    "walks-past",
)  # fmt: skip
DT_S = 0.01
SCRIPT = """round_s: 20.0
room: none
places:
  here: {x_m: 1.0, y_m: 0.0, height_m: 1.2}
  there: {x_m: 1.0, y_m: 0.5, height_m: 1.2}
people:
  anna:
    start: here
    acts:
"""
BOXING = load_scene("boxing")


def times(scene: Scene, dt_s: float = DT_S) -> list[float]:
    """Return the instants of one round and a little of the next."""
    return np.arange(0.0, scene.round_s + 0.5, dt_s).tolist()


def named(name: str) -> list[Event]:
    return [event for event in BOXING.events() if event.name == name]


def thing(t_s: float, kind: str, id_: int | None = None) -> Thing | None:
    for each in BOXING.things(t_s):
        if each.kind == kind and id_ in (None, each.id):
            return each
    return None


def test_all_scenes_are_there_under_their_names() -> None:
    assert scene_names() == NAMES
    assert all(load_scene(name).name == name for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_looking_twice_or_backwards_shows_the_same(name: str) -> None:
    scene, again = load_scene(name), load_scene(name)
    forward = [(scene.people(t), scene.things(t)) for t in times(scene, 0.5)]
    backward = [(again.people(t), again.things(t)) for t in times(scene, 0.5)[::-1]]
    assert forward == backward[::-1]


@pytest.mark.parametrize("name", NAMES)
def test_nobody_jumps_and_no_thing_is_faster_than_a_fist(name: str) -> None:
    scene = load_scene(name)
    before_people, before = scene.people(0.0), {t.id: t for t in scene.things(0.0)}
    for t_s in times(scene)[1:]:
        people, things = scene.people(t_s), {t.id: t for t in scene.things(t_s)}
        for old, new in zip(before_people, people, strict=True):
            assert dist(old.p_world_face_m, new.p_world_face_m) / DT_S < 2.7, t_s  # walking
            turn = abs(new.face_yaw_pitch_rad[0] - old.face_yaw_pitch_rad[0])
            assert degrees(min(turn, abs(turn - 2 * np.pi))) / DT_S < 250.0, t_s
        for id_ in before.keys() & things.keys():
            assert dist(before[id_].p_world_m, things[id_].p_world_m) / DT_S < 5.0, t_s
            assert before[id_].kind == things[id_].kind
        before_people, before = people, things


@pytest.mark.parametrize("name", NAMES)
def test_events_lie_inside_the_round_and_in_order(name: str) -> None:
    scene = load_scene(name)
    events = scene.events()
    assert all(0.0 <= event.start_s < event.end_s <= scene.round_s for event in events)
    starts = [event.start_s for event in events]
    assert starts == sorted(starts)


@pytest.mark.parametrize("kind", ["hand", "face"])
def test_what_an_event_asks_for_is_where_it_says(kind: str) -> None:
    scene = BOXING
    for event in (event for event in scene.events() if event.kind == kind):
        for t_s in np.linspace(event.start_s, event.end_s - 0.01, 20).tolist():
            places = [each.p_world_m for each in scene.things(t_s) if each.kind == kind]
            if kind == "face":
                places = [scene.people(t_s)[0].p_world_face_m]
            assert min(dist(place, event.place_world_m) for place in places) < event.within_m


def test_the_round_of_boxing_holds_several_of_each() -> None:
    for name, least in [("punch", 3), ("attack", 3), ("wave", 2), ("reach", 2), ("step", 2)]:
        assert len(named(name)) >= least, name
    assert len(named("return")) >= 2 and len(named("face")) >= 8
    busy = sum(e.end_s - e.start_s for e in BOXING.events() if e.name != "face")
    quiet = sum(e.end_s - e.start_s for e in named("face"))
    assert busy + quiet <= BOXING.round_s + 1e-9 and quiet > 0.4 * BOXING.round_s


def test_a_punch_comes_within_reach_of_the_face_in_a_quarter_of_a_second() -> None:
    for event in named("punch"):
        ways = []
        for t_s in np.arange(event.start_s, event.end_s, 0.005).tolist():
            ways.append([dist(each.p_world_m, HEAD_M) for each in BOXING.things(t_s)[:2]])
        nearest = np.array(ways).min(axis=1)
        assert nearest.min() == pytest.approx(0.35, abs=0.02)
        assert nearest.argmin() * 0.005 == pytest.approx(0.25, abs=0.03)
        assert nearest[0] > 0.75 and nearest[-1] > 0.75


def test_a_fist_turns_as_fast_as_its_spin_says_and_only_in_a_punch() -> None:
    dt_s, spins, punches = 1e-3, [], named("punch")
    for t_s in np.arange(0.0, BOXING.round_s, 0.01).tolist():
        before, now = BOXING.things(t_s)[:2], BOXING.things(t_s + dt_s)[:2]
        for old, new in zip(before, now, strict=True):
            turned = (new.turned_rad - old.turned_rad) / dt_s
            assert turned == pytest.approx(0.5 * (old.spin_rad_s + new.spin_rad_s), abs=0.05)
        punched = any(event.start_s < t_s < event.end_s for event in punches)
        fastest = max(abs(fist.spin_rad_s) for fist in before)
        assert fastest < 0.01 or punched
        spins.append(fastest)
    assert max(spins) > 8.0


def test_an_opening_leaves_the_chest_or_the_face_free_and_the_guard_neither() -> None:
    def clear_m(t_s: float, off: Vec3) -> float:
        face = np.array(BOXING.people(t_s)[0].p_world_face_m)
        way = face + off - HEAD_M
        along = way / np.linalg.norm(way)
        fists = [np.array(thing.p_world_m) - HEAD_M for thing in BOXING.things(t_s)[:2]]
        return min(float(np.linalg.norm(fist - (fist @ along) * along)) for fist in fists)

    chest, cheek = (0.0, 0.0, -0.3), (0.0, 0.06, 0.0)
    assert max(clear_m(0.5, chest), clear_m(0.5, cheek)) < 0.22
    open_places = []
    for event in named("attack"):
        middle_s = 0.5 * (event.start_s + event.end_s)
        open_places.append((clear_m(middle_s, chest) > 0.3, clear_m(middle_s, cheek) > 0.3))
    assert set(open_places) == {(True, False), (False, True)}


def test_a_hand_reaches_in_from_outside_the_field_and_the_event_begins_as_it_enters() -> None:
    sides = set()
    for event in named("reach"):
        entered = thing(event.start_s, "hand", 2)
        outside = thing(event.start_s - 0.05, "hand", 2)
        inside = thing(event.start_s + 1.0, "hand", 2)
        assert entered is not None and outside is not None and inside is not None
        angles = [
            abs(atan2(hand.p_world_m[1] - HEAD_M[1], hand.p_world_m[0] - HEAD_M[0]))
            for hand in (outside, entered, inside)
        ]
        assert angles[0] > HALF_FIELD_RAD > angles[2]
        assert angles[1] == pytest.approx(HALF_FIELD_RAD, abs=0.01)
        sides.add(entered.p_world_m[1] > 0.0)
        opponent = BOXING.people(event.start_s)[0].p_world_face_m
        assert abs(opponent[1]) < 0.02  # so that the robot looks straight ahead
    assert sides == {True, False}


def test_the_opponent_steps_left_and_right() -> None:
    y = [BOXING.people(t)[0].p_world_face_m[1] for t in times(BOXING)]
    assert max(y) > 0.2 and min(y) < -0.2


def test_face_to_face_walks_about_at_the_heights_of_sitting_standing_and_a_child() -> None:
    scene = load_scene("face-to-face")
    faces = np.array([scene.people(t)[0].p_world_face_m for t in times(scene)])
    distances = np.linalg.norm(faces - HEAD_M, axis=1)
    assert distances.min() > 0.6 and distances.max() < 1.5
    assert distances.max() - distances.min() > 0.4
    heights = faces[:, 2]
    for low, high in ((-0.05, 0.02), (0.2, 0.25), (0.58, 0.65)):
        assert DT_S * np.count_nonzero((heights > low) & (heights < high)) > 8.0
    assert faces[:, 1].max() > 0.4 and faces[:, 1].min() < -0.4


def test_face_to_face_mostly_faces_the_robot() -> None:
    scene = load_scene("face-to-face")
    off = []
    for t_s in times(scene):
        (x, y, z), (yaw, pitch) = scene.people(t_s)[0][:2]
        to_head = (HEAD_M[0] - x, HEAD_M[1] - y, HEAD_M[2] - z)
        side = yaw - atan2(to_head[1], to_head[0])
        up = pitch - atan2(to_head[2], hypot(to_head[0], to_head[1]))
        off.append(degrees(hypot((side + np.pi) % (2 * np.pi) - np.pi, up)))
    share = float(np.mean(np.array(off) < 5.0))
    assert 0.7 < share < 0.95
    assert max(off) < 25.0


def test_there_and_back_rises_holds_and_falls_without_a_step() -> None:
    values = [there_and_back(t, 0.2, 0.1, 0.3) for t in np.arange(-0.1, 0.8, 0.001).tolist()]
    assert values[0] == values[-1] == 0.0
    assert there_and_back(0.1, 0.2, 0.1, 0.3) == pytest.approx(0.5)
    assert there_and_back(0.25, 0.2, 0.1, 0.3) == 1.0
    assert there_and_back(0.45, 0.2, 0.1, 0.3) == pytest.approx(0.5)
    assert np.abs(np.diff(values)).max() < 1.875 / 0.2 * 0.001 * 1.01
    assert there_and_back(0.15, 0.15, 0.0, 0.15) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("acts", "line", "rule"),
    [
        ("      - {at_s: 1, do: sit}\n", 10, "without a room a person can only walk, step"),
        ("      - {at_s: 1, do: punch, to: head}\n", 10, "without a room a person can only walk"),
        ("      - {at_s: 1, do: walk, to: moon}\n", 10, "none has no place 'moon'; it has here"),
        ("      - {at_s: 1, do: step}\n", 10, "unknown place; known places: here, there"),
        ("      - {at_s: 1, do: look_at, to: bob}\n", 10, "not a person and not a place"),
        ("      - {at_s: 1, do: walk, to: there}\n", 9, "the round ends at there"),
        ("      - {at_s: 1, do: glance, yaw_deg: 9}\n", 9, "a glance of (9.0, 0.0) deg"),
        ("      - {at_s: 19, do: wave}\n", 10, "ends at 21.6 s, the round at 20 s"),
        ("      - {at_s: 9, do: wave}\n      - {at_s: 1, do: wave}\n", 11, "order of time"),
        ("      - {at_s: 9, do: wave, for_s: 0.5}\n", 10, "wave takes at least 0.8 s"),
        ("      []\nthings: {cup: {held_by: anna}}\n", 11, "there are pinwheel, hand"),
        ("      []\nthings: {a: {kind: hand, at: moon}}\n", 11, "no place 'moon'"),
        ("      []\nexpected: [{name: a, kind: face, start_s: 1, end_s: 30, at: here}]\n", 11, "the round"),
    ],
)  # fmt: skip
def test_a_script_that_cannot_be_played_is_refused_at_its_line(
    tmp_path: Path, acts: str, line: int, rule: str
) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(SCRIPT + acts)
    with pytest.raises(ConfigError) as caught:
        load_scene(str(file))
    assert f"own.yaml:{line}:" in str(caught.value) and rule in str(caught.value)


def test_a_script_of_ones_own_is_played_and_its_seed_varies_it(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    walks = "- {at_s: 5, do: walk, to: there, vary_s: 2}\n      - {at_s: 12, do: walk, to: here}"
    file.write_text(f"{SCRIPT}      {walks}\n")
    one, same, other = (load_scene(str(file), seed) for seed in (0, 0, 1))
    assert one.people(5.5) == same.people(5.5) != other.people(5.5)
    assert one.people(9.0)[0].p_world_face_m == pytest.approx((1.0, 0.5, 0.25))


def test_a_room_is_for_worlds_alone(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(SCRIPT.replace("none", "gym") + "      []\n")
    with pytest.raises(ConfigError, match="use --world"):
        load_scene(str(file))

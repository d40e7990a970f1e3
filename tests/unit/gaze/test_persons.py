"""Rules name persons by what they do: in the YAML, from frame to frame, and in a scene of three."""

from math import pi, sin
from pathlib import Path

import numpy as np
import pytest
from attention_scene import attention, looking

from gazerig.config.faults import ConfigError
from gazerig.config.schema import load_rules
from gazerig.gaze.angles import rotation
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.attention.top_down import Rule, TopDownParams
from gazerig.gaze.track.track_trigger import TrackTrigger
from gazerig.gaze.types import Bodies, Face, Percept, Target, Vec3

EYE: Vec3 = (0.0, 0.0, 0.0)
LEFT, RIGHT, FAR = (1.0, 0.4, 0.0), (1.1, -0.4, 0.0), (2.0, 0.0, 0.0)


def percept(
    t_s: float, faces: dict[int, Vec3], looks: tuple[int, ...] = (), hand: Vec3 | None = None,
    hand_y_m_s: float = 0.0,
) -> Percept:  # fmt: skip
    n = len(faces) + (hand is not None)
    places = np.array([*faces.values(), *([hand] if hand is not None else [])]).reshape(-1, 3)
    v = np.zeros((n, 3))
    if hand is not None:
        v[-1, 1] = hand_y_m_s
    ids = (*faces, *((99,) if hand is not None else ()))
    kinds = ("face",) * len(faces) + ("hand",) * (hand is not None)
    R = rotation((pi, 0.0, 0.0))
    seen = tuple(
        Face(id, p, EYE, R, (p,) * 8, 0.9, looks_at_head=id in looks) for id, p in faces.items()
    )
    return Percept(t_s, Bodies(ids, kinds, places, v, np.zeros((n, 3)), np.full(n, 0.1)), seen)


def test_the_nearest_is_the_nearest_until_another_is_clearly_so():
    persons = Persons()
    for away, nearest in [(1.2, 5), (1.0, 5), (0.95, 5), (0.8, 7), (0.95, 7), (1.2, 5)]:
        persons.update(percept(away, {5: (1.0, 0.0, 0.0), 7: (away, 0.01, 0.0)}), EYE)
        assert persons.ids_with_trait("nearest") == {nearest}, away
    persons.update(percept(2.0, {}), EYE)
    assert persons.ids_with_trait("nearest") == frozenset()


def test_the_newest_came_last_and_who_came_together_is_named_together():
    persons = Persons()
    assert persons.ids_with_trait("newest") == frozenset()
    persons.update(percept(0.0, {5: LEFT}), EYE)
    persons.update(percept(0.3, {5: LEFT, 2: RIGHT}), EYE)
    assert persons.ids_with_trait("newest") == {5, 2}
    for t_s in (4.0, 9.0):
        persons.update(percept(t_s, {5: LEFT, 1: FAR, 2: RIGHT}), EYE)
        assert persons.ids_with_trait("newest") == {1}
    # Out of view for a while, they are not new.
    persons.update(percept(12.0, {1: FAR}), EYE)
    persons.update(percept(15.0, {5: LEFT, 1: FAR, 2: RIGHT}), EYE)
    assert persons.ids_with_trait("newest") == {1}


@pytest.mark.parametrize(
    ("hz", "swing_m", "beside", "waves"),
    [(1.5, 0.11, RIGHT, True), (2.5, 0.06, RIGHT, True), (0.4, 0.11, RIGHT, False),
     (1.5, 0.02, RIGHT, False), (1.5, 0.11, (1.0, 1.9, 0.0), False)],
)  # fmt: skip
def test_a_hand_that_swings_to_both_sides_waves_for_the_nearest_face(
    hz: float, swing_m: float, beside: Vec3, waves: bool
):
    persons, named = Persons(), []
    for k in range(90):
        t_s = k / 30
        phase = 2 * pi * hz * t_s
        hand = (beside[0] - 0.1, beside[1] - 0.25 + swing_m * sin(phase), beside[2])
        v = 2 * pi * hz * swing_m * np.cos(phase)
        persons.update(percept(t_s, {5: LEFT, 2: RIGHT}, (), hand, v), EYE)
        named.append(persons.ids_with_trait("waving"))
    assert (named[-1] == {2}) is waves and (named[-1] == frozenset()) is not waves
    assert named[5] == frozenset()
    for k in range(90, 150):
        persons.update(percept(k / 30, {5: LEFT, 2: RIGHT}), EYE)
    assert persons.ids_with_trait("waving") == frozenset()


@pytest.mark.parametrize(
    ("look_at", "says"),
    [("person:wawing", 'persons: "person:nearest", "person:waving", "person:looking", "person:newest"'),
     ("persons:nearest", 'or persons: "person:nearest"'), ("nearest", 'or persons: "person:nearest"')],
)  # fmt: skip
def test_a_wrong_word_is_refused_with_the_right_ones(look_at: str, says: str, tmp_path: Path):
    with pytest.raises(ValueError, match=says):
        Rule(look_at, 0.5)
    file = tmp_path / "mine.yaml"
    file.write_text(f'behaviour: a\nrules:\n  a:\n    look_at: "{look_at}"\n    salience: 0.5\n')
    with pytest.raises(ConfigError, match=r"mine\.yaml") as refused:
        load_rules(str(file))
    assert says in str(refused.value)


def shares(look_at: str, numbers: tuple[int, int, int]) -> list[float]:
    """Return how much of the time each of three people is looked at by a rule.

    The first is the nearest, the second came last and waves, the third looks at the head.
    """
    model = attention(TopDownParams(rules={"wait": Rule(look_at, 2.5)}), np.random.default_rng(0))
    people, found = dict(zip(numbers, (LEFT, RIGHT, FAR), strict=True)), []
    for k in range(1500):
        t_s = k / 30
        here = {id: p for id, p in people.items() if p != RIGHT or t_s > 5.0}
        phase = 2 * pi * 1.5 * t_s
        hand = (1.0, -0.65 + 0.11 * sin(phase), 0.0)
        seen = percept(t_s, here, numbers[2:], hand, 2 * pi * 0.165 * np.cos(phase))
        target = model.choose(seen, looking(), t_s + 0.05)
        if t_s >= 7.0:
            found.append(target.id)
    return [found.count(id) / len(found) for id in numbers]


@pytest.mark.parametrize(
    ("trait", "person", "numbers"),
    [("nearest", 0, (4, 9, 2)), ("newest", 1, (31, 5, 17)), ("waving", 1, (4, 9, 2)),
     ("looking", 2, (31, 5, 17))],
)  # fmt: skip
def test_e78_a_rule_finds_its_person_whatever_their_number(
    trait: str, person: int, numbers: tuple[int, int, int]
):
    assert shares(f"person:{trait}", numbers)[person] > 0.9


def test_a_gesture_of_such_a_rule_is_for_the_named_alone():
    trigger, rule = TrackTrigger(), Rule("person:waving", 0.9, gesture="nod")
    face = Target(LEFT, EYE, 0.0, "face", 5, 0.9, True, None, 0, "")
    assert trigger.step("greet", rule, face, 0.0) == ""
    assert trigger.step("greet", rule, face, 0.1, frozenset((2,))) == ""
    assert trigger.step("greet", rule, face, 0.2, frozenset((5,))) == "nod"

"""Rules name persons by what they do: in the YAML, from frame to frame, and in a scene of three."""

from math import cos, exp, pi, sin

import numpy as np
import pytest
from attention_scene import attention, body, looking
from attention_scene import percept as scene
from msgspec.structs import replace

from gazerig.config.faults import ConfigError
from gazerig.config.schema import load_rules
from gazerig.gaze.angles import rotation
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.attention.top_down import Rule, TopDownParams
from gazerig.gaze.track.track_trigger import TrackTrigger
from gazerig.gaze.types import Face, Target

EYE = (0.0, 0.0, 0.0)
LEFT, RIGHT, FAR = (1.0, 0.4, 0.0), (1.1, -0.4, 0.0), (2.0, 0.0, 0.0)


def percept(
    t_s, faces, looks=(), hand=None,
    v=EYE,
):  # fmt: skip
    rows = [body(id, "face", p) for id, p in faces.items()]
    rows += [] if hand is None else [body(99, "hand", hand, v)]
    R = rotation((pi, 0.0, 0.0))
    seen = tuple(
        Face(id, p, EYE, R, (p,) * 8, 0.9, looks_at_head=id in looks) for id, p in faces.items()
    )
    return replace(scene(t_s, *rows), faces=seen)


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
def test_a_hand_that_swings_to_both_sides_waves_for_the_nearest_face(hz, swing_m, beside, waves):
    persons, named = Persons(), []
    for k in range(90):
        t_s = k / 30
        phase = 2 * pi * hz * t_s
        hand = (beside[0] - 0.1, beside[1] - 0.25 + swing_m * sin(phase), beside[2])
        v = (0.0, 2 * pi * hz * swing_m * cos(phase), 0.0)
        persons.update(percept(t_s, {5: LEFT, 2: RIGHT}, (), hand, v), EYE)
        named.append(persons.ids_with_trait("waving"))
    assert (named[-1] == {2}) is waves and (named[-1] == frozenset()) is not waves
    assert named[5] == frozenset()
    for k in range(90, 150):
        persons.update(percept(k / 30, {5: LEFT, 2: RIGHT}), EYE)
    assert persons.ids_with_trait("waving") == frozenset()


FRONT = (1.0, 0.0, 0.0)


def moving(t_s, place, v, cut_off=False):
    """Return a frame of face 5 and a hand that moves."""
    seen = percept(t_s, {5: FRONT}, (), place, v)
    return replace(seen, bodies=replace(seen.bodies, cut_off=(99,) * cut_off))


def test_a_hand_is_part_of_a_person_or_raised_or_reaches_out():
    for place, cut_off, part, raised in (
        # Raised at most .08 m below the face; in reach at less than .9 m from it, which is 53 deg
        # at 1 m, or half of that.
        ((1.0, 0.3, -0.07), False, False, True), ((1.0, 0.3, -0.09), False, True, False),
        ((1.0, 1.32, -0.2), False, True, False), ((1.0, 1.35, -0.2), False, False, False),
        ((1.0, 0.44, -0.2), True, True, False), ((1.0, 0.45, -0.2), True, False, False),
        # Not nearer than .65 of the face's distance: there it reaches out.
        ((0.64, 0.0, -0.2), False, True, False), ((0.6, 0.0, -0.2), False, False, False),
        # Its distance is not known: it is compared at the face's.
        ((3.0, 2.4, -0.3), False, True, False),
    ):  # fmt: skip
        persons = Persons()
        persons.update(moving(0.0, place, EYE, cut_off), EYE)
        assert (persons.parts == {99: 5}, persons.raised == {99}) == (part, raised), place


def test_a_hand_that_repeats_its_motion_or_sinks_is_weaker():
    def factor(repeats=True, sinks=False):
        factors = {5: 1.0, 99: 0.8}
        persons.weaken_known(factors, repeats, sinks)
        assert factors[5] == 1.0
        return factors[99] / 0.8

    # Across the view, which is along x for a hand at the side; it is 2 m to the left of the eye.
    persons, factors = Persons(), list[float]()
    eye = (1.0, -1.7, 0.0)
    for k in range(5):
        v = (0.3 * (-1.0) ** k, 9.0, 0.0)
        persons.update(moving(0.2 * k, (1.0, 0.3, 0.0), v), eye)
        factors.append(factor())
    # The second and later turns count; each wears off within 2 s.
    third = 1.0 + exp(-0.1)
    expected = [1.0, 1.0, 1.0, 0.5 ** (third - 1.0), 0.5 ** (third * exp(-0.1))]
    assert factors == pytest.approx(expected)
    assert factor(repeats=False) == 1.0
    for side_m_s in (0.24, 0.3, 0.3):  # too slow, and no turn
        persons.update(moving(0.8, (1.0, 0.3, 0.0), (side_m_s, 0.0, 0.0)), eye)
    assert factor() == pytest.approx(expected[-1])
    persons.update(moving(4.8, (1.0, 0.3, 0.0), EYE), eye)
    assert factor() == 1.0

    for v, sinks in (((0.0, 0.2, -0.26), True), ((0.0, 0.3, -0.26), False),
                     ((0.0, 0.0, -0.24), False)):  # fmt: skip
        persons = Persons()
        persons.update(moving(1.0, (1.0, 0.3, 0.0), v), EYE)
        assert (factor(sinks=True) == 0.0) is sinks and factor() == 1.0
    for t_s, v, weak in ((2.0, (0.0, 0.0, -1.0), True), (2.25, EYE, True), (2.35, EYE, False)):
        persons.update(moving(t_s, (1.0, 0.3, 0.0), v), EYE)
        assert (factor(sinks=True) == 0.0) is weak


def test_who_signs_for_long_raises_no_hand():
    persons, raised = Persons(), []
    for k in range(60):
        speed_m_s = 0.26 if 0 < k < 40 else 0.24
        persons.update(moving(0.1 * k, (1.0, 0.3, -0.2), (0.0, 0.0, speed_m_s)), EYE)
        persons.update(moving(0.1 * k, (1.0, 0.3, 0.0), EYE), EYE)
        raised.append(99 in persons.raised)
    # 1 - .95^14 is above .5, and so is .95^12 of what is left of the signs, 1 - .95^39.
    assert raised == [True] * 14 + [False] * 36 + [True] * 10


def test_who_is_seen_first_or_again_is_new_for_two_seconds():
    persons, new = Persons(), []
    for t_s in (10.0, 11.9, 12.1, 15.0, 18.2, 20.1, 20.3):
        persons.update(percept(t_s, {5: LEFT}), EYE)
        new.append(persons.new == {5})
    assert new == [True, True, False, False, True, True, False]


def test_who_is_looked_at_or_has_not_been_seen_silent_may_speak():
    persons = Persons()
    persons.update(percept(0.0, {5: LEFT, 2: RIGHT, 8: FAR}), EYE)
    talk = percept(1.0, {5: LEFT, 2: RIGHT})
    five, two = (replace(one, off_head_rad=1.0, gaze_world=way) for one, way in
                 zip(talk.faces, ((0.1, -0.8, 0.0), (0.0, -1.0, 0.0)), strict=True))  # fmt: skip
    rows = percept(1.0, {5: LEFT, 2: RIGHT, 8: FAR}).bodies.rows()
    persons.update(replace(talk, faces=(five, two)), EYE)
    assert persons.may_speak(rows) == frozenset(), "nobody has spoken yet"
    persons.update(replace(talk, captured_s=2.0, faces=(replace(five, speaks=True), two)), EYE)
    assert persons.speaking == {5} and persons.may_speak(rows) == {2}
    for t_s, who in ((7.9, {2}), (8.1, {8})):
        persons.update(replace(talk, captured_s=t_s, faces=(five, two)), EYE)
        assert persons.may_speak(rows) == who
    persons.update(replace(talk, captured_s=9.0, faces=(five, replace(two, speaks=True))), EYE)
    persons.update(replace(talk, captured_s=9.1, faces=(five, two)), EYE)
    assert persons.may_speak(rows) == {8}, "the last speaker is not the next one"


@pytest.mark.parametrize(
    ("look_at", "says"),
    [("person:wawing", 'persons: "person:nearest", "person:waving", "person:looking", "person:newest"'),
     ("persons:nearest", 'or persons: "person:nearest"'), ("nearest", 'or persons: "person:nearest"')],
)  # fmt: skip
def test_a_wrong_word_is_refused_with_the_right_ones(look_at, says, tmp_path):
    with pytest.raises(ValueError, match=says):
        Rule(look_at, 0.5)
    file = tmp_path / "mine.yaml"
    file.write_text(f'behaviour: a\nrules:\n  a:\n    look_at: "{look_at}"\n    salience: 0.5\n')
    with pytest.raises(ConfigError, match=r"mine\.yaml") as refused:
        load_rules(str(file))
    assert says in str(refused.value)


def shares(look_at, numbers):
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
        v = (0.0, 2 * pi * 0.165 * cos(phase), 0.0)
        seen = percept(t_s, here, numbers[2:], hand, v)
        target = model.choose(seen, looking(), t_s + 0.05)
        if t_s >= 7.0:
            found.append(target.id)
    return [found.count(id) / len(found) for id in numbers]


@pytest.mark.parametrize(
    ("trait", "person", "numbers"),
    [("nearest", 0, (4, 9, 2)), ("newest", 1, (31, 5, 17)), ("waving", 1, (4, 9, 2)),
     ("looking", 2, (31, 5, 17))],
)  # fmt: skip
def test_e78_a_rule_finds_its_person_whatever_their_number(trait, person, numbers):
    assert shares(f"person:{trait}", numbers)[person] > 0.9


def test_a_gesture_of_such_a_rule_is_for_the_named_alone():
    trigger, rule = TrackTrigger(), Rule("person:waving", 0.9, gesture="nod")
    face = Target(LEFT, EYE, 0.0, "face", 5, 0.9, True, None, 0, "")
    assert trigger.step("greet", rule, face, 0.0) == ""
    assert trigger.step("greet", rule, face, 0.1, frozenset((2,))) == ""
    assert trigger.step("greet", rule, face, 0.2, frozenset((5,))) == "nod"

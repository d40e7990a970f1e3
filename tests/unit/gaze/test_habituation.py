"""Interest that wears off, the place just left, and several people who share the gaze."""

from itertools import groupby
from math import exp, log, radians
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from attention_scene import NO_STAYS, attention, body, looking, percept

from gazerig.gaze.attention.habituation import Habituation, HabituationParams
from gazerig.gaze.types import Percept

EYE = (0.0, 0.0, 0.0)
PARAMS = HabituationParams()
RATE_HZ = 15


def bodies(kinds, *places):
    rows = zip(kinds.split(), places, strict=True)
    return percept(0.0, *(body(k, *row) for k, row in enumerate(rows, 1))).bodies


def arc(*away_m):
    """Return faces at these distances, from the left to the right."""
    aside = np.radians(np.linspace(22.0, -22.0, len(away_m)))
    places = [(d * np.cos(a), d * np.sin(a), 0.0) for d, a in zip(away_m, aside, strict=True)]
    return bodies(" ".join(["face"] * len(away_m)), *places)


def watch(
    seen,
    seconds,
    later=None,
    habituation=PARAMS,
):
    """Let attention look at a scene that stays as it is."""
    model = attention(habituation=habituation)
    scenes = [seen, later] if later is not None else [seen]
    times = [k / RATE_HZ for k in range(round(RATE_HZ * seconds * len(scenes)))]
    return [model.choose(Percept(t, scenes[int(t / seconds)]), looking(), t) for t in times]


def waits_s(targets, n):
    """Return for how long each of n bodies was not looked at, at most."""
    ids = np.array([target.id for target in targets])
    on = [np.flatnonzero(np.concatenate(([True], ids == k, [True]))) for k in range(1, n + 1)]
    return [float(np.diff(one).max()) / RATE_HZ for one in on]


def shares(targets):
    ids = [target.id for target in targets]
    return {name: ids.count(name) / len(ids) for name in set(ids)}


def stays_s(targets):
    """Return how long each look lasted, without the last one, which the end cuts short."""
    return [len(list(same)) / RATE_HZ for _, same in groupby(t.id for t in targets)][:-1]


def interest(model, seen, attended, t_s):
    return [*model.step(seen.rows(), EYE, attended, t_s).values()]


def test_interest_falls_while_attended_and_recovers_otherwise():
    model = Habituation(PARAMS, NO_STAYS)
    seen = bodies("face face", (1, 0.5, 0), (1, -0.5, 0))
    assert interest(model, seen, -1, 0.0) == [1.0, 1.0]
    assert interest(model, seen, 1, 2.0) == pytest.approx([0.6, 1.0])
    assert interest(model, seen, 1, 30.0) == [0.0, 1.0]
    assert interest(model, seen, 2, 30.5) == pytest.approx([0.5, 0.9])
    assert interest(model, seen, -1, 31.5) == [1.0, 1.0]


def test_a_rule_keeps_its_floor_of_interest():
    """A second of looking, at a body of half the weight, is a lead of two."""
    model = Habituation(HabituationParams(rule_floor=0.6, decay_rate_1_s=0.3), NO_STAYS)
    two = {1: 1.0, 2: 0.5}
    assert model.share(two, 1, 0.0) == pytest.approx({1: 1.0, 2: 1.0}, abs=0.01)
    assert model.share(two, 2, 1.0)[1] == 1.0
    assert model.share(two, -1, 1.0)[2] == pytest.approx(0.6 + 0.4 * exp(-0.6), abs=0.01)
    assert model.share({2: 0.5}, 2, 9.0) == {2: 1.0}  # one alone is not left for habituation


@pytest.mark.parametrize(
    ("drawn", "people", "stay_s"),
    [(-99.0, 2, 0.0), (0.0, 3, 1.28), (99.0, 2, 6.0), (99.0, 4, 0.0)],
)
def test_a_look_lasts_longer_by_a_draw_and_by_six_seconds_at_most(drawn, people, stay_s):
    rng: Any = SimpleNamespace(standard_normal=lambda: drawn)
    model = Habituation(PARAMS, rng)
    model.start_stay(1)
    looks = (k / 30 for k in range(400))
    lasts_s = next(
        t_s for t_s in looks if model.share(dict.fromkeys(range(people), 1.0), 1, t_s)[1] < 1.0
    )
    # What has been seen fades within 10 s.
    assert lasts_s == pytest.approx(-10.0 * log(1.0 - 0.1 * (0.6 + stay_s)), abs=0.04)


@pytest.mark.parametrize(("aside_deg", "age_s"), [(0.0, 0.0), (4.0, 0.0), (4.0, 1.5), (20.0, 0.0)])
def test_the_place_left_is_avoided_by_a_gaussian_that_decays(aside_deg, age_s):
    model = Habituation(PARAMS, NO_STAYS)
    a = radians(aside_deg)
    seen = bodies("hand", (2 * np.cos(a), 2 * np.sin(a), 0))
    interest(model, seen, -1, 10.0)
    model.record_left((1.0, 0.0, 0.0), 10.0)
    expected = 1.0 - 0.5 * np.exp(-0.5 * (aside_deg / 4.0) ** 2 - age_s / 1.5)
    assert interest(model, seen, -1, 10.0 + age_s) == pytest.approx([expected])
    assert interest(model, seen, -1, 17.0) == [1.0]


def test_a_single_still_face_is_never_left():
    targets = watch(bodies("face", (1, 0, 0)), 120.0)
    assert {(t.id, t.kind, t.salience, t.shift) for t in targets} == {(1, "face", 0.5, 1)}


@pytest.mark.parametrize(
    "away_m", [(1.5, 1.0), (0.8, 3.0, 3.0, 3.0), (1.0, 1.0, 2.0, 2.0, 3.0, 4.0)]
)
def test_people_are_looked_at_for_times_as_their_nearness(away_m):
    share = shares(watch(arc(*away_m), 120.0))
    weights = np.array(away_m) ** -0.5
    measured = [share[id] for id in range(1, len(away_m) + 1)]
    assert measured == pytest.approx(weights / weights.sum(), abs=0.03)


@pytest.mark.parametrize("n", [3, 4, 6, 8])
def test_nobody_of_many_waits_for_long_and_no_look_is_a_glance(n):
    targets = watch(arc(*[1.5] * n), 60.0)
    assert max(waits_s(targets, n)) < 15.0 and min(shares(targets).values()) > 0.75 / n
    assert min(stays_s(targets)[n:]) > 1.0


def sharing():
    return Habituation(PARAMS, NO_STAYS)


def test_surpluses_grow_with_the_looks_and_are_those_over_the_one_looked_at_least():
    shared, three = sharing(), dict.fromkeys((1, 2, 3), 1.0)
    assert shared.surpluses(three, -1, 0.0) == {1: 0.0, 2: 0.0, 3: 0.0}
    assert shared.surpluses(three, 2, 0.5) == pytest.approx({1: 0.0, 2: 0.5, 3: 0.0})
    # A new person is behind no one; the heaviest of similar ones comes first.
    assert shared.surpluses({2: 0.5, 4: 1.0}, 4, 0.5)[4] == 0.0
    found = shared.surpluses({1: 1.0, 2: 0.5, 4: 1.0}, 1, 0.9)
    assert found[4] == 0.0 and found[1] == pytest.approx(0.4) and 0.45 < found[2] < 0.5


def test_surpluses_are_bounded_fade_and_are_forgotten():
    shared, three = sharing(), dict.fromkeys((1, 2, 3), 1.0)
    for k in range(100):
        found = shared.surpluses(three, 1, 0.5 * k)
    assert found == {1: 8.0, 2: 0.0, 3: 0.0}
    assert 0.0 < shared.surpluses(three, -1, 60.0)[1] < 3.0
    shared.reset(60.0)
    assert shared.surpluses(three, -1, 60.0) == {1: 0.0, 2: 0.0, 3: 0.0}

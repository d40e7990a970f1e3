"""Looking away from faces."""

from itertools import pairwise
from math import atan2, degrees, inf
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from gaze_targets import target
from msgspec.structs import replace

from gazerig.gaze.angles import angle_between, sub, unit
from gazerig.gaze.attention.conversation import (
    AversionParams,
    ConversationGaze,
    ConversationParams,
)
from gazerig.gaze.types import Salience, Vec3

DT = 0.02
HEAD = (0.05, 0.0, 0.2)
FACE = (1.2, 0.1, 0.35)
EYE = (1.2, 0.13, 0.38)


def face(shift=1, name=4):
    eye = target(EYE, (0.0, 0.1, 0.0), id=name, shift=shift, centre=FACE)
    return replace(eye, part="LE", why="left eye of face 4")


ATTENTION: Any = SimpleNamespace(converse=lambda *of: None, search=None)
PARAMS = AversionParams(), ConversationParams()


def aversion(seed=0, looks_away="people", mode="none"):
    rngs = (np.random.default_rng((seed, n)) for n in range(2))
    model = ConversationGaze(looks_away, *PARAMS, ATTENTION, *rngs)
    model.choose_mode(mode, 0.0)
    return model


def kinds(model, start_s, seconds, ordered=False):
    """Return what is looked at in each tick of a time with one face."""
    times = [start_s + k * DT for k in range(round(seconds / DT))]
    return [model.look(face(), HEAD, t, ordered=ordered).kind for t in times]


def leaves_at(model):
    """Return when the gaze leaves the face for the first time."""
    t = 0.0
    while model.look(face(), HEAD, t).kind == "face":
        t += DT
    return t


class Stay(NamedTuple):
    """One stay on the face or away from it: its kind, length and first place."""

    kind: str
    seconds: float
    place: Vec3


def stays(model, seconds, dt=DT):
    """Run on one face and give the complete stays."""
    found, since = [], 0.0
    first = model.look(face(), HEAD, 0.0)
    for k in range(1, round(seconds / dt)):
        now = model.look(face(), HEAD, k * dt)
        if now.kind != first.kind:
            found.append(Stay(first.kind, k * dt - since, first.p_world_m))
            first, since = now, k * dt
    return found


def test_who_never_looks_away_passes_targets_untouched():
    model, seen = aversion(looks_away="none"), face()
    for k in range(5000):
        if k == 1000:
            model.choose_mode("think", k * DT)
        assert model.look(seen, HEAD, k * DT) is seen


def angles_and_ways(model, seconds):
    """Return distance and direction of the stays, 0 right and 90 up, degrees."""
    to_face = unit(sub(FACE, HEAD))
    found = [s.place for s in stays(model, seconds, 0.1) if s.kind == "away"]
    far = [degrees(angle_between(to_face, sub(p, HEAD))) for p in found]
    ways = []
    for p in found:
        way = sub(unit(sub(p, HEAD)), to_face)
        ways.append(degrees(atan2(way[2], -way[1])) % 360.0)
    return np.array(far), np.array(ways)


def test_how_far_away_follows_the_published_law():
    """Beyond the face's outline, at most 8.7 deg here with what is kept beside it."""
    model = aversion(7, mode="talk")
    far, _ = angles_and_ways(model, 20_000.0)
    beyond = far[far > 9.0] - 9.0
    assert beyond.mean() == pytest.approx(10.0 * (1.0 - np.exp(-21.0 / 10.0)), abs=0.4)
    assert np.median(beyond) == pytest.approx(10.0 * np.log(2.0), abs=0.4)
    assert far.max() == pytest.approx(30.0, abs=0.01)


def test_a_look_away_leaves_when_the_rest_on_a_part_is_over():
    model = aversion(4)
    for k in range(4000):
        assert model.look(face(), HEAD, 0.01 * k, rests_until_s=inf).kind == "face"
    assert model.look(face(), HEAD, 40.0, rests_until_s=40.1).kind == "face"
    assert model.look(face(), HEAD, 40.1, rests_until_s=40.1).kind == "away"
    # It returns when its own time is over, whatever the walk over the face chooses.
    later = [model.look(face(), HEAD, 40.1 + 0.01 * k, rests_until_s=inf).kind for k in range(400)]
    assert later.index("face") > 15


def test_the_head_takes_its_share_in_a_thinkers_look_away():
    model = aversion(11, mode="think")
    model.look(face(), HEAD, 0.0)
    seen = [model.look(face(), HEAD, k * DT) for k in range(500)]
    away = next(t for t in seen if t.kind == "away")
    assert (away.id, away.part, away.top_down) == (4, None, True)
    between = [f + 0.4 * (p - f) for f, p in zip(FACE, away.p_world_m, strict=True)]
    assert away.centre_world_m == pytest.approx(between)
    assert away.v_world_m_s == (0.0, 0.0, 0.0)
    assert away.why == "looking away from face 4 (thinking)"
    distance = [float(np.linalg.norm(sub(p, HEAD))) for p in (away.p_world_m, FACE)]
    assert distance[0] == pytest.approx(distance[1])


def test_every_place_and_return_is_one_new_shift_and_the_count_never_falls():
    model = aversion(12, mode="talk")
    # The part beneath changes every 0.4 s, also while the gaze is away.
    seen = [model.look(face(k // 20), HEAD, k * DT) for k in range(5000)]
    turns = places = 0
    for before, now in pairwise(seen):
        assert now.shift >= before.shift
        if now.kind != before.kind:
            turns += 1
            assert now.shift > before.shift
        elif now.kind == "away":
            moved = now.p_world_m != before.p_world_m
            assert (now.shift > before.shift) == moved
            assert moved or now == replace(before, at_s=now.at_s)
            places += moved
    assert turns > 20 and places > turns / 3
    model.choose_mode("none", 100.0)
    after = model.look(face(250), HEAD, 100.02)
    assert after.kind == "face" and after.shift > seen[-1].shift - 1
    assert after == replace(face(250), shift=after.shift)


@pytest.mark.parametrize("state", ["thinking", "speaking"])
def test_the_look_away_of_a_turn_goes_on_with_another_partner(state):
    model = aversion(15)
    model.look(face(), HEAD, 0.0)
    model.enter(state, 5, None, 0.0, 0.0)
    assert model.look(face(), HEAD, DT).kind == "away"
    after = [model.look(face(2, name=5), HEAD, k * DT) for k in range(2, 25)]
    assert {(one.kind, one.id) for one in after} == {("away", 5)}


def test_motion_ends_a_look_away():
    model = aversion(16, mode="think")
    t = leaves_at(model)
    still, walker = (Salience(9, "thing", translation=v) for v in (0.5, 2.0))
    assert model.look(replace(face(), saliences=(still,)), HEAD, t + DT).kind == "away"
    assert model.look(replace(face(), saliences=(walker,)), HEAD, t + 2 * DT).kind == "face"


# ---- without a conversation -----------------------------------------------------------


def test_a_target_that_a_user_has_chosen_is_left_in_a_conversation_only():
    model = aversion(18)
    t = leaves_at(model)
    assert set(kinds(model, t, 20.0, ordered=True)) == {"face"}
    again = kinds(model, t + 20.0, 20.0)
    assert again[0] == "face" and "away" in again
    model.choose_mode("talk", t + 40.0)
    assert set(kinds(model, t + 40.0, 40.0, ordered=True)) == {"face", "away"}

"""The gaze with no one in sight."""

from dataclasses import replace
from itertools import pairwise
from math import degrees
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gazerig.gaze.angles import norm, sub, yaw_pitch
from gazerig.gaze.attention.idle import Idle, IdleParams
from gazerig.gaze.types import Target, Vec3

DT = 0.01
EYE = (0.0, 0.0, 0.2)


def seen(p=(1.0, 0.2, 0.2), v=(0.0, 0.0, 0.0), at_s=0.0):
    return Target(p, v, at_s, "face", 3, 0.5, True, None, 7, "face 3")


def idle(seed=0, **params):
    return Idle(IdleParams(**params), np.random.default_rng(seed))


def run(model, start_s, end_s):
    return [model.step(start_s + k * DT) for k in range(round((end_s - start_s) / DT))]


def yaw_deg(target):
    return degrees(yaw_pitch(sub(target.p_world_m, EYE))[0])


def looks(targets):
    """Return each look once, with its length; the last, cut short, is left out."""
    found: list[tuple[Target, float]] = []
    count = 1
    for before, now in pairwise(targets):
        if (now.kind, now.id) == (before.kind, before.id):
            count += 1
            continue
        found.append((before, count * DT))
        count = 1
    return found


def test_waiting_keeps_the_identity_and_the_place_it_had_got_to():
    model = idle()
    model.remember(seen(v=(0.0, 0.3, 0.0), at_s=0.95))
    held = model.step(1.0)
    assert (held.kind, held.id, held.why) == ("face", 3, "lost, waiting")
    assert held.p_world_m == pytest.approx((1.0, 0.215, 0.2))
    assert held.v_world_m_s == (0.0, 0.0, 0.0)
    model.remember(seen(v=(0.0, 0.3, 0.0), at_s=0.0))
    assert model.step(9.0).p_world_m == pytest.approx((1.0, 0.26, 0.2))


MIDDLE: Any = SimpleNamespace(
    random=lambda: 0.5,
    uniform=lambda low, high: (low + high) / 2.0,
    standard_normal=lambda: 0.0,
    standard_exponential=lambda: 1.0,
    integers=lambda n: n - 1,
)
"""Draws the middle of each range, and the median of a law."""


def shifts(model, seconds):
    """Return time, kind and yaw of each shift of gaze; each has a number of its own."""
    found = dict[int, Any]()
    for k in range(round(seconds / DT)):
        look = model.step(k * DT)
        found.setdefault(look.id, (round(k * DT, 2), look.kind, round(yaw_deg(look), 2)))
    assert [*found][1:] == [*range(-2, -1 - len(found), -1)]
    return [*found.values()]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_lost_person_is_sought_where_they_went_and_about_the_place(side):
    """Steps of 15 deg, each for the median of .6 s, until 3 s have passed; then back to it."""
    model = Idle(IdleParams(), MIDDLE)
    model.remember(seen((1.0, side * 0.3, 0.2), (0.0, side * 0.8, 0.0)))
    lost, far = round(side * 16.7, 2), round(side * 31.7, 2)
    assert shifts(model, 4.5) == [
        (0.0, "face", lost), (1.0, "search", far), (1.52, "search", lost), (2.03, "search", far),
        (2.55, "search", lost), (3.06, "search", far), (3.58, "search", lost),
        (4.0, "search", lost),
    ]  # fmt: skip


def test_who_sees_nobody_looks_about():
    """To one side and the other, back to where people look, and glances of .69 s between."""
    assert shifts(Idle(IdleParams(), MIDDLE), 7.0) == [
        (0.0, "rest", 0.0), (0.6, "search", 70.0), (2.0, "search", -13.0), (2.69, "glance", 0.0),
        (3.38, "glance", -13.0), (4.06, "glance", 0.0), (4.75, "glance", -13.0),
        (5.43, "search", -70.0), (6.83, "search", -13.0),
    ]  # fmt: skip


@pytest.mark.parametrize(("place", "most"), [((0.5, 0.9, 0.2), 70.0), ((0.1, 0.9, 0.2), 83.7)])
def test_search_goes_no_farther_than_its_reach_or_the_loss(place, most):
    yaws = []
    for seed in range(30):
        model = idle(seed)
        model.remember(seen(place, (-0.5, 0.2, 0.0)))
        yaws += [yaw_deg(t) for t in run(model, 0.0, 4.0) if t.kind == "search"]
    assert most - 25.0 < max(yaws) <= most + 0.1


def test_e76_glances_are_human_in_length_size_place_and_number():
    found = looks(run(idle(6), 0.0, 900.0))
    glances = [(t, s) for t, s in found if t.kind == "glance"]
    rests = [s for t, s in found if t.kind == "rest"]
    asides = [(t, s) for t, s in found if t.kind == "search"]
    assert {t.kind for t, _ in found} == {"glance", "rest", "search"}
    far = [yaw_deg(t) for t, _ in asides if abs(yaw_deg(t)) > 69.0]
    assert len(far) > 900.0 / 10.0 and all(a * b < 0.0 for a, b in pairwise(far)), "in turn"
    assert 0.9 <= len(found) / 900.0 <= 2.0
    assert np.mean([s for _, s in glances]) == pytest.approx(0.8, rel=0.1)
    assert np.mean(rests) == pytest.approx(1.0, rel=0.2)
    assert min(s for _, s in found) >= 0.25 - DT
    yaws, pitches = np.degrees([yaw_pitch(sub(t.p_world_m, EYE)) for t, _ in glances]).T
    assert np.abs(yaws).max() <= 30.0 + 1e-6 and np.abs(pitches).max() <= 12.0 + 1e-6
    assert abs((yaws > 0.0).mean() - 0.5) < 0.12
    # More at the middle than at the edges, but not there alone, and wider than high.
    assert (np.abs(yaws) < 15.0).mean() > 0.6
    assert 8.0 < yaws.std() < 18.0 and 2.5 < pitches.std() < 0.6 * yaws.std()
    ways = [(a[0], b[0]) for a, b in pairwise(found) if a[0].kind == b[0].kind == "glance"]
    sizes = np.array([step_deg(a, b) for a, b in ways])
    assert sizes.min() >= 2.0 - 1e-6
    assert 0.7 <= (sizes < 15.0).mean() <= 0.97 and 4.0 <= np.median(sizes) <= 9.0
    assert len(ways) / len(glances) > 0.5


def step_deg(one, other):
    (yaw, pitch), (to_yaw, to_pitch) = (
        np.degrees(yaw_pitch(sub(t.p_world_m, EYE))) for t in (one, other)
    )
    return float(np.hypot(to_yaw - yaw, to_pitch - pitch))


THINGS: dict[int, Vec3] = {4: (1.4, 0.5, 0.2), 5: (1.5, -0.7, 0.1), 6: (1.2, 0.0, 0.5)}


def test_e76_glances_go_to_what_is_in_view_and_to_what_was_there_lately():
    model = idle(3)
    on = {name: 0 for name in THINGS}
    for k in range(30_000):
        t = k * DT
        if k < 20_000:
            model.record_seen(THINGS, t)
        elif k == 20_000:
            model.record_seen({}, t)
        now = model.step(t)
        for name, place in THINGS.items():
            on[name] += norm(sub(now.p_world_m, place)) < 1e-6 and k < 20_000
        remembered = any(norm(sub(now.p_world_m, place)) < 1e-6 for place in THINGS.values())
        assert k < 22_400 or not remembered, "forgotten after 20 s, and the last look"
    shares = np.array(list(on.values())) / 20_000
    assert 0.15 <= shares.sum() <= 0.7 and shares.min() >= 0.04


def test_who_does_not_explore_rests_straight_ahead_until_told_to():
    still = IdleParams(explores=False)
    model = Idle(still, np.random.default_rng(0))
    assert {model.step(0.1 * k).kind for k in range(1200)} == {"rest"}
    model.retune(replace(still, explores=True))
    assert "glance" in {model.step(120.0 + 0.1 * k).kind for k in range(600)}
    model.retune(still)
    assert {model.step(180.0 + 0.1 * k).kind for k in range(1200)} == {"rest"}

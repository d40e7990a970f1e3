"""The gaze with no one in sight."""

from dataclasses import replace
from itertools import pairwise
from math import degrees
from typing import Any

import numpy as np
import pytest

from gazerig.gaze.angles import norm, sub, yaw_pitch
from gazerig.gaze.attention.idle import Idle, IdleParams
from gazerig.gaze.types import Target, Vec3

DT = 0.01
EYE: Vec3 = (0.0, 0.0, 0.2)


def seen(p: Vec3 = (1.0, 0.2, 0.2), v: Vec3 = (0.0, 0.0, 0.0), at_s: float = 0.0) -> Target:
    return Target(p, v, at_s, "face", 3, 0.5, True, None, 7, "face 3")


def idle(seed: int = 0, **params: Any) -> Idle:
    return Idle(IdleParams(**params), np.random.default_rng(seed))


def run(model: Idle, start_s: float, end_s: float) -> list[Target]:
    return [model.step(start_s + k * DT) for k in range(round((end_s - start_s) / DT))]


def yaw_deg(target: Target) -> float:
    return degrees(yaw_pitch(sub(target.p_world_m, EYE))[0])


def looks(targets: list[Target]) -> list[tuple[Target, float]]:
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


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_search_goes_first_to_the_side_the_target_left_to(side: float):
    for seed in range(20):
        model = idle(seed)
        model.remember(seen((1.0, side * 0.3, 0.2), (0.0, side * 0.8, 0.0), 0.0))
        lost = yaw_deg(model.step(0.0))
        search = [t for t in run(model, 0.0, 4.0) if t.kind == "search"]
        assert side * (yaw_deg(search[0]) - lost) == pytest.approx(15.0, abs=5.1)
        assert search[0].why == "looking for face 3"


@pytest.mark.parametrize(("place", "most"), [((0.5, 0.9, 0.2), 70.0), ((0.1, 0.9, 0.2), 83.7)])
def test_search_goes_no_farther_than_its_reach_or_the_loss(place: Vec3, most: float):
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


def step_deg(one: Target, other: Target) -> float:
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


def test_search_stays_about_the_place_of_the_loss():
    offsets = []
    for seed in range(100):
        model = idle(seed)
        model.remember(seen())
        lost = yaw_deg(seen())
        found = looks(run(model, 0.0, 8.0))
        search = [t for t, _ in found if t.kind == "search"]
        assert 2 <= len(search) <= 12
        offsets += [yaw_deg(t) - lost for t in search]
    assert abs(np.mean(offsets)) < 2.0
    assert 6.0 < np.std(offsets) < 16.0


def test_each_glance_is_a_look_of_its_own():
    model = idle(7)
    model.remember(seen())
    targets = run(model, 0.0, 60.0)
    model.remember(seen(at_s=60.0))
    targets += run(model, 60.1, 120.0)
    ids = [t.id for t, _ in looks(targets) if t.kind in ("search", "glance")]
    assert len(ids) > 20
    assert ids == list(range(-2, -2 - len(ids), -1))
    assert {t.id for t in targets if t.kind == "rest"} == {-1}

"""The head between shifts and from shift to shift: pursuit, recentring, scatter, search."""

from math import degrees, pi, radians
from typing import Any

import numpy as np
import pytest
from gaze_targets import DT, target, turn

from gazerig.gaze.oculomotor.head import HeadModel, HeadParams
from gazerig.gaze.types import Floats, Target

NECK = ((-1.3, 1.3), (-0.6, 0.6))
ROLL = (-0.4, 0.4)


def model(seed: int | None = 0, **params: Any) -> HeadModel:
    rng = None if seed is None else np.random.default_rng(seed)
    return HeadModel(HeadParams(**params), radians(35.0), NECK, ROLL, rng)


def seen(id: int = 1, kind: str = "face") -> Target:
    return target(kind=kind, id=id, top_down=True, shift=id)


def follow(head: HeadModel, place: Floats, kind: str = "face") -> Floats:
    """Return the yaws of a head with a target at these yaws, one a tick; degrees."""
    yaws = [0.0]
    for k, yaw in enumerate(place.tolist()):
        ahead = min(len(place) - 1, k + round(head.foresees_s / DT))
        now, soon = (radians(yaw), 0.0), (radians(place[ahead]), 0.0)
        aside = abs(radians(yaw - yaws[-1]))
        moves = None if soon == now else soon
        turned = head.step(seen(kind=kind), now, now, aside, 1.0, k * DT, moves)
        yaws.append(degrees(turned[0]))
    return np.array(yaws[1:])


def test_the_head_pursues_a_walker_with_a_lag_of_people() -> None:
    t = np.arange(0.0, 40.0, DT)
    walk = 25.0 * np.sin(2.0 * pi * 0.08 * t)
    yaws = follow(model(), walk)
    late = t > 15.0
    lags = [np.abs(yaws[late] - np.interp(t[late] - lag, t, walk)).mean() for lag in LAGS_S]
    assert 0.1 <= LAGS_S[int(np.argmin(lags))] <= 0.25
    assert np.abs(walk - yaws)[late].max() < 6.0
    assert np.abs(np.diff(yaws, 2)).max() / DT**2 < 1000.0, "no jerk of the neck"


LAGS_S = np.arange(0.0, 0.6, 0.02)


def test_slow_and_short_motion_is_left_to_the_eyes() -> None:
    t = np.arange(0.0, 10.0, DT)
    assert np.abs(follow(model(), 1.0 * t, "thing")).max() == 0.0, (
        "1 deg/s, within the range of the eyes"
    )
    jump = np.clip((t - 2.0) * 180.0, 0.0, 9.0)
    assert np.abs(follow(model(), jump, "thing")).max() == 0.0
    walk = 12.0 * np.sin(2.0 * pi * 0.08 * t)
    assert np.abs(follow(model(goal_model="attention"), walk, "thing")).max() == 0.0


def test_after_pursuit_the_head_comes_to_rest() -> None:
    t = np.arange(0.0, 12.0, DT)
    walk = np.minimum(10.0 * t, 40.0)
    yaws = follow(model(), walk)
    assert yaws[-1] == pytest.approx(40.0, abs=3.0) and yaws.max() < 44.0
    assert np.ptp(yaws[t > 8.0]) < 0.1


def test_the_head_goes_on_with_a_walker_during_a_look_away() -> None:
    head, yaws, place = model(), list[float](), 0.0
    for k in range(round(3.0 / DT)):
        t, place = k * DT, 12.0 * k * DT
        away = t >= 2.2
        now = (radians(place), 0.0)
        past = (radians(38.0), 0.0) if away else now
        soon = None if away else (radians(place + 12.0 * head.foresees_s), 0.0)
        aside = abs(past[0] - radians(yaws[-1] if yaws else 0.0))
        on = seen(kind="away" if away else "face")
        yaws.append(degrees(head.step(on, now, past, aside, 1.0, t, soon)[0]))
    late = round(2.4 / DT)
    assert (yaws[-1] - yaws[late]) / (3.0 - 2.4) == pytest.approx(12.0, abs=1.5)
    assert 0.0 < place - yaws[-1] < 4.0


def test_recentring_is_late_random_and_slow() -> None:
    place = np.full(round(30.0 / DT), 32.0)
    starts, peaks, ends = [], [], []
    for seed in range(30):
        yaws = follow(model(seed), place, "thing")
        held = yaws[round(2.0 / DT)]
        assert held == pytest.approx(0.77 * (32.0 - 17.9), abs=3.5)
        after = yaws[round(2.0 / DT) :]
        moved = np.flatnonzero(after > held + 0.1)
        if len(moved):
            starts.append(2.0 + moved[0] * DT)
            peaks.append(np.diff(after).max() / DT)
            ends.append(32.0 - after[-1])
    assert len(starts) > 20 and min(starts) >= 3.0
    assert 5.0 < np.mean(starts) < 11.0 and np.std(starts) > 1.5
    assert max(peaks) <= 12.1
    assert min(ends) >= 0.25 * 10.0 - 0.1 and max(ends) <= 10.0


@pytest.mark.parametrize(("elsewhere", "id"), [("away", 1), ("hand", 1_000_001), ("face", 1)])
def test_the_head_comes_to_face_a_person_in_spite_of_short_looks_elsewhere(
    elsewhere: str, id: int
) -> None:
    def place(t: float) -> tuple[Target, float]:
        return seen(id, elsewhere) if t % 2.0 > 1.4 else seen(), 10.0

    yaws = np.array([turn(model(seed), 20.0, place) for seed in range(24)])
    assert np.abs(yaws[:, : round(3.0 / DT)]).max() == 0.0
    turned = yaws[:, -1] > 5.0
    assert 0.7 < turned.mean() < 1.0 and yaws.max() <= 8.01
    half = [np.argmax(row > 3.0) * DT for row in yaws[turned]]
    assert 6.0 < np.mean(half) < 11.0 and np.std(half) > 2.0
    assert np.diff(yaws).max() / DT <= 12.1


@pytest.mark.parametrize(
    ("salience", "top_down", "turns"), [(0.9, True, True), (0.5, True, False), (0.9, False, False)]
)
def test_the_head_recentres_soon_before_what_it_is_most_interested_in(
    salience: float, top_down: bool, turns: bool
) -> None:
    urgent = target(kind="attack_target", salience=salience, top_down=top_down)
    assert (turn(model(), 2.0, lambda t: (urgent, 15.0))[-1] > 5.0) == turns


def shifts(seed: int | None) -> Floats:
    """Return how far the head turned for 40 deg, 40 times; degrees."""
    head, turned = model(seed), []
    for n in range(40):
        head.reset(n * 2.0, (0.0, 0.0, 0.0))
        place = (radians(40.0), 0.0)
        yaw = 0.0
        for k in range(240):
            t = n * 2.0 + k * DT
            yaw = head.step(seen(n), place, place, abs(place[0] - yaw), 1.0, t)[0]
        turned.append(degrees(yaw))
    return np.array(turned)


def test_equal_shifts_scatter_within_bounds() -> None:
    slopes = shifts(3) / (40.0 - 17.9)
    assert slopes.mean() == pytest.approx(0.77, abs=0.05)
    assert 0.06 < slopes.std() < 0.14 and np.abs(slopes - 0.77).max() <= 0.201
    assert np.ptp(shifts(None)) < 1e-9, "without a generator all are equal"


def test_the_head_is_first_in_half_of_its_own_looks_and_never_in_a_reaction() -> None:
    head = model(5)
    own = [head.draw_lead_s(seen(-2 - n, "glance"), 0.7) for n in range(600)]
    assert 0.5 < np.mean(np.array(own) > 0.0) < 0.75
    assert 0.35 < np.mean(np.array(own) > 0.008) < 0.6 and max(own) <= 0.071
    assert max(head.draw_lead_s(seen(n), 0.7) for n in range(200)) == 0.0
    assert max(head.draw_lead_s(seen(-2, "glance"), 0.1) for n in range(50)) == 0.0


def test_a_search_is_completed_by_the_head() -> None:
    place = np.full(round(3.0 / DT), 15.0)
    assert follow(model(), place, "search")[-1] == pytest.approx(9.0, abs=1.1)
    assert follow(model(), place, "glance")[-1] == 0.0


@pytest.mark.parametrize("law", ["attention", "align"])
def test_the_papers_heads_are_not_random(law: str) -> None:
    place = np.full(200, 50.0)
    one, other = (follow(model(seed, goal_model=law), place) for seed in (1, None))
    assert (one == other).all()
    assert model(1, goal_model=law).draw_lead_s(seen(), 1.0) == 0.0

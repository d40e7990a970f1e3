"""Blinks and lids that follow the gaze."""

from math import radians

import numpy as np
import pytest

from gaze.lids import LidParams, Lids

DT = 0.005


def lids(seed: int = 0, **params: float) -> Lids:
    return Lids(LidParams(**params), np.random.default_rng(seed))


def onsets(model: Lids, seconds: float) -> list[float]:
    times, count = [], 0
    for k in range(int(seconds / DT)):
        model.step(k * DT, 0.0, None)
        if model.blinks > count:
            count = model.blinks
            times.append(k * DT)
    return times


def test_rate_spread_and_refractory_time() -> None:
    times = np.array(onsets(lids(3, blinks_per_min=26.0), 1200.0))
    gaps = np.diff(times)
    assert len(times) / 20.0 == pytest.approx(26.0, abs=4.0)
    assert 0.4 <= gaps.std() / gaps.mean() <= 1.2
    assert gaps.min() >= 1.0


def test_no_blinks_where_none_are_wanted() -> None:
    assert onsets(lids(blinks_per_min=0.0), 120.0) == []


def test_shape_closes_faster_than_it_opens_and_shuts_fully() -> None:
    model = lids()
    t = np.arange(0.0, 0.4, 0.0005)
    closure = np.array([model.closure(s) for s in t])
    assert closure.max() == 1.0 and closure[-1] == 0.0
    speed = np.diff(closure) / 0.0005
    assert speed.max() >= 1.5 * -speed.min()
    shut = t[closure >= 0.999]
    assert 0.020 <= shut[-1] - shut[0] <= 0.060


def test_large_shifts_bring_a_blink_and_small_ones_do_not() -> None:
    share = {}
    for size in (10.0, 40.0):
        count = 0
        for seed in range(400):
            model = lids(seed, blinks_per_min=0.0)
            model.step(1.0, 0.0, radians(size))
            count += model.blinks
        share[size] = count / 400
    assert 0.05 <= share[10.0] <= 0.35
    assert share[40.0] >= 0.9


def test_one_shift_throws_its_dice_once() -> None:
    model = lids(1, blinks_per_min=0.0)
    model.step(0.0, 0.0, radians(60.0))
    for k in range(1, 1000):
        model.step(k * DT, 0.0, None)
    assert model.blinks == 1


def test_lids_follow_the_eyes_and_stay_between_shut_and_open() -> None:
    model = lids(blinks_per_min=0.0)
    level, up, down = (model.step(0.0, radians(a), None)[0] for a in (0.0, 10.0, -30.0))
    assert up > level > down > 0.0
    assert model.step(0.0, radians(80.0), None)[0] == 1.0
    assert model.step(0.0, radians(-89.0), None)[0] == 0.0


def test_same_dice_same_blinks() -> None:
    assert onsets(lids(7), 60.0) == onsets(lids(7), 60.0) != onsets(lids(8), 60.0)

"""True joints of emulated rigs: range, speed and acceleration, late ticks and slow entries."""

from collections.abc import Iterator
from math import radians
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from mixed_rig import rig_of
from true_shafts import Bench, Judge, restless

from gazerig.config.schema import Rig
from gazerig.drivers.bus.servo_models import HOBBY_KINDS
from gazerig.robot.run.rig_limits import limits

NAMES = ("desk", "feetech", "maker", "pca9685", "mixed")
BEYOND_DEG = 0.8
"""A balanced neck needs .5; a heavy one sags further until its compensation follows (3 deg/s)."""
SPEED = 1.03
"""Of the limit: 2 % of the joint's own, 1 % of rounding to servo steps in 5 ms."""
ACCEL = 1.1
"""Of the limit, over 10 ms: goals are whole steps, a neck's limit 2 of them in (10 ms)^2."""
DRAWN = (Phase.explicit, Phase.generate)
"""Every example takes a second: none is made simpler."""
GENTLE = 1.15
"""Of the gentle speed: a goal moves by whole steps, 3 or 4 in a tick of 5 ms; geared up, 2 or 3."""


@pytest.fixture(scope="module")
def rigs(tmp_path_factory) -> dict[str, Rig]:
    folder = tmp_path_factory.mktemp("rig")
    return {name: rig_of(name, folder) for name in NAMES}


def gaps(seed: int, share: float, longest: int) -> Iterator[int]:
    """Draw how many slots are missed before each tick."""
    rng = np.random.default_rng(seed)
    while True:
        yield int(np.ceil(longest ** rng.random())) if rng.random() < share else 0


def driven(rig: Rig, seed: int, missed: Iterator[int], seconds: float) -> Judge:
    """Drive a rig with wishes that jump inside and outside its range."""
    bench, judge = Bench(rig), Judge(rig)
    bench.start()
    desired = restless(rig, seed)
    centre = (0.0,) * len(rig.names)
    while any(bench.guard._gentle):
        bench.tick(centre)
    bench.shafts.clear()
    end_s = bench.shafts.now_s() + seconds
    while bench.shafts.now_s() < end_s:
        bench.tick(desired(bench.shafts.now_s()), next(missed))
    judge.take(bench.shafts)
    return judge


def judged(judge: Judge) -> None:
    for name, worst in judge.worst.items():
        i = judge.rig.names.index(name)
        assert worst.stops == 0, f"{name} touched its stop"
        assert worst.beyond_deg <= BEYOND_DEG, f"{name} {worst.beyond_deg:.2f} deg beyond its range"
        if judge.rig.bus_named(judge.rig.joints[name].bus).kind in HOBBY_KINDS:
            continue  # a hobby servo leaps from pulse to pulse as it likes
        assert worst.speed_deg_s <= SPEED * judge.top[i], f"{name} {worst.speed_deg_s:.0f} deg/s"
        assert worst.accel_deg_s2 <= ACCEL * judge.most[i], f"{name} {worst.accel_deg_s2:.0f}"


@pytest.mark.parametrize("name", NAMES)
def test_true_joints_keep_range_speed_and_acceleration_whatever_is_wished(rigs, name):
    judged(driven(rigs[name], 1, gaps(0, 0.0, 1), 3.0))


@settings(max_examples=10, deadline=None, phases=DRAWN)
@given(
    name=st.sampled_from(NAMES),
    seed=st.integers(0, 1000),
    share=st.sampled_from((0.01, 0.05, 0.2, 0.5)),
    longest=st.sampled_from((1, 2, 10, 400)),
)
def test_true_joints_keep_them_for_any_pattern_of_late_ticks(rigs, name, seed, share, longest):
    judged(driven(rigs[name], seed, gaps(seed, share, longest), 2.0))


def where_from(rig: Rig, rng: np.random.Generator) -> dict[str, float]:
    """Draw a pose in and outside the range, up to the mechanical stops."""
    beyond = radians(4.0)
    return {
        name: float(rng.uniform(limit.low_rad - beyond, limit.high_rad + beyond))
        if rng.random() < 0.5
        else float(rng.choice([limit.low_rad, limit.high_rad]) + rng.uniform(-beyond, beyond))
        for name, limit in zip(rig.names, limits(rig.joints), strict=True)
    }


@settings(max_examples=10, deadline=None, phases=DRAWN)
@given(name=st.sampled_from(("desk", "feetech")), seed=st.integers(0, 10_000), again=st.booleans())
def test_joints_come_from_anywhere_slowly_at_start_and_at_resume(rigs, name, seed, again):
    rig, rng = rigs[name], np.random.default_rng(seed)
    desired = restless(rig, seed, 60.0)(0.0)
    bench = Bench(rig, None if again else where_from(rig, rng))
    bench.start()
    if again:
        for _ in range(100):
            bench.tick(desired)
        bench.stop()
        for joint, angle in where_from(rig, rng).items():
            bench.turn(joint, angle)
        bench.resume()
    bench.shafts.angles_rad.clear()
    gentle: list[Any] = []
    for _ in range(300):
        bench.tick(desired)
        gentle += [list(bench.guard._gentle)] * (len(bench.shafts.angles_rad) - len(gentle))
    angles = np.degrees(np.array(bench.shafts.angles_rad))
    speed = np.abs(angles[5:] - angles[:-5]) / 0.005 * np.array(gentle)[5:]
    most = GENTLE * rig.guard.soft_start_speed_deg_s
    assert dict(zip(rig.names, (speed.max(axis=0) <= most).tolist(), strict=True)) == dict.fromkeys(
        rig.names, True
    )
    assert all(
        limit.low_rad - radians(BEYOND_DEG) <= now <= limit.high_rad + radians(BEYOND_DEG)
        for now, limit in zip(bench.shafts.truth(), limits(rig.joints), strict=True)
    )

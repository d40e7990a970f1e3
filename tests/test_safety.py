"""The guard: whatever is wished, nothing outside any limit leaves."""

from itertools import pairwise
from math import cos, inf, nan, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.safety import Guard, GuardParams, JointLimit
from robot.types import JOINTS, JointState

EYE = JointLimit(radians(-35), radians(35), radians(600), radians(45_000))
NECK = JointLimit(radians(-60), radians(50), radians(200), radians(1_500))
LIMITS = (EYE,) * 6 + (NECK,) * 3
DT = 0.005
SLACK = 1e-9


def measured(t_s: float) -> JointState:
    return JointState((0.0,) * 9, (0.0,) * 9, (t_s,) * 9, ())


def ready(start: tuple[float, ...] = (0.0,) * 9, limits: tuple[JointLimit, ...] = LIMITS) -> Guard:
    guard = Guard(GuardParams(), limits)
    guard.reset(0.0, start)
    guard._gentle = [False] * 9  # the slow start has tests of its own
    return guard


def test_a_wish_inside_everything_passes_unchanged() -> None:
    guard = ready()
    for k in range(1, 400):
        t = k * DT
        wish = (0.05 * (1.0 - cos(2.0 * t)),) * 9
        verdict = guard.check(wish, measured(t), 0.0, t)
        assert verdict.command_rad == pytest.approx(wish, abs=1e-12)
        assert verdict.level == "ok" and verdict.reasons == ()


def test_one_million_random_wishes_never_leave_the_limits() -> None:
    rng = np.random.default_rng(11)
    special = np.array([nan, inf, -inf, 1e300, -1e300, 0.0, 35.0, -35.0])
    count = 1_000_000 // 9 + 1
    wishes = rng.normal(0.0, 1.2, (count, 9)) * rng.choice([0.05, 1.0, 30.0], (count, 9))
    odd = rng.random((count, 9)) < 0.05
    wishes[odd] = rng.choice(special, int(odd.sum()))
    ticks = rng.choice([0.001, 0.004, 0.005, 0.005, 0.005, 0.006, 0.02, 0.1], count)
    guard, t = ready(), 0.0
    times, commands = [0.0], [(0.0,) * 9]
    for wish, dt in zip(wishes.tolist(), ticks.tolist(), strict=True):
        t += dt
        ages = measured(t if dt < 0.02 else t - 1.0)
        times.append(t)
        commands.append(guard.check(tuple(wish), ages, 0.0, t).command_rad)
    low, high, speed, accel = (np.array(column) for column in zip(*LIMITS, strict=True))
    p, dt_s = np.array(commands), np.diff(times)[:, None]
    v = np.diff(p, axis=0) / dt_s
    assert np.isfinite(p).all()
    assert (p >= low).all() and (p <= high).all()
    assert (np.abs(v) <= speed + 1e-6).all()
    assert (np.abs(np.diff(v, axis=0, prepend=0.0)) <= accel * dt_s + 1e-6).all()


@settings(max_examples=60, deadline=None)
@given(
    wishes=st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=60),
    ticks=st.lists(st.floats(0.0005, 0.05), min_size=60, max_size=60),
)
def test_a_joint_can_always_stop_inside_its_range(wishes: list[float], ticks: list[float]) -> None:
    guard, t = ready(), 0.0
    for wish, dt in zip(wishes, ticks, strict=False):
        t += dt
        guard.check((wish,) * 9, measured(t), 0.0, t)
    commands = []
    for dt in ticks * 20:  # now everything is stale: all must come to rest
        t += dt
        commands.append(guard.check((nan,) * 9, measured(t), 0.0, t).command_rad)
    assert commands[-1] == commands[-2]
    for command in commands:
        for angle, limit in zip(command, LIMITS, strict=True):
            assert limit.low_rad <= angle <= limit.high_rad


@pytest.mark.parametrize("joint", [0, 6])
def test_range_is_swept_densely_at_its_edges(joint: int) -> None:
    limit = LIMITS[joint]
    for edge in (limit.low_rad, limit.high_rad):
        for off in np.linspace(-0.01, 0.01, 41):
            guard = ready(tuple(edge if i == joint else 0.0 for i in range(9)))
            wish = tuple(edge + off if i == joint else 0.0 for i in range(9))
            verdict = guard.check(wish, measured(DT), 0.0, DT)
            inside = limit.low_rad <= verdict.command_rad[joint] <= limit.high_rad
            outside = not limit.low_rad - 1e-9 <= edge + off <= limit.high_rad + 1e-9
            assert inside
            assert (f"{JOINTS[joint]}: out of range" in verdict.reasons) == outside


def test_speed_is_swept_densely_at_its_limit() -> None:
    for share in np.linspace(0.95, 1.05, 21):
        soft = tuple(limit._replace(accel_rad_s2=1e9) for limit in LIMITS)
        guard = ready(limits=soft)
        step = EYE.speed_rad_s * DT * share
        verdict = guard.check((step,) + (0.0,) * 8, measured(DT), 0.0, DT)
        assert verdict.command_rad[0] <= EYE.speed_rad_s * DT * (1.0 + 1e-12)
        assert ("left_eye_pan: too fast" in verdict.reasons) == (share > 1.0 + 1e-9)


def test_acceleration_is_swept_densely_at_its_limit() -> None:
    for share in np.linspace(0.95, 1.05, 21):
        guard = ready()
        step = NECK.accel_rad_s2 * DT * DT * share
        verdict = guard.check((0.0,) * 6 + (step, 0.0, 0.0), measured(DT), 0.0, DT)
        assert verdict.command_rad[6] <= NECK.accel_rad_s2 * DT * DT * (1.0 + 1e-12)
        assert ("neck_yaw: too hard" in verdict.reasons) == (share > 1.0 + 1e-9)


def test_not_finite_wishes_hold_and_say_so() -> None:
    for bad in (nan, inf, -inf):
        verdict = ready().check((bad,) * 9, measured(DT), 0.0, DT)
        assert verdict.level == "hold"
        assert verdict.command_rad == (0.0,) * 9
        assert "neck_roll: not finite" in verdict.reasons


def test_stale_joints_hold_only_themselves() -> None:
    guard, t = ready(), 0.3
    ages = measured(t)._replace(measured_s=(t,) * 8 + (t - 0.2,))
    verdict = guard.check((0.001,) * 9, ages, 0.0, t)
    assert verdict.reasons == ("neck_roll: stale joints",)
    assert verdict.command_rad[8] == 0.0 and verdict.command_rad[0] == pytest.approx(0.001)


def test_a_stale_picture_holds_the_neck_and_not_the_eyes() -> None:
    verdict = ready().check((0.0001,) * 9, measured(DT), 2.0, DT)
    held = {reason for reason in verdict.reasons if reason.endswith("stale picture")}
    assert held == {f"{name}: stale picture" for name in JOINTS if name.startswith("neck")}
    assert verdict.command_rad[6:] == (0.0,) * 3
    assert verdict.command_rad[0] == pytest.approx(0.0001)


def test_it_starts_slowly_from_where_the_joints_are_until_each_has_met_its_wish() -> None:
    guard = Guard(GuardParams(gentle_speed_deg_s=60.0, gentle_accel_deg_s2=300.0), LIMITS)
    guard.reset(0.0, (0.5,) * 9)
    path, t = [0.5], 0.0
    while guard.gentle and t < 3.0:
        t += DT
        verdict = guard.check((0.0,) * 9, measured(t), 0.0, t)
        path.append(verdict.command_rad[0])
    speeds = np.diff(path) / DT
    assert np.abs(speeds).max() <= radians(60.0) + 1e-9
    assert np.abs(np.diff(speeds)).max() / DT <= radians(301.0)
    assert not guard.gentle and abs(path[-1]) < radians(1.0) and t >= 1.0
    assert all(b <= a + SLACK for a, b in pairwise(path))
    for _ in range(100):
        t += DT
        verdict = guard.check((0.3,) * 9, measured(t), 0.0, t)
    assert verdict.command_rad[0] == pytest.approx(0.3)


def test_going_gently_in_flight_brakes_within_the_joints_own_strength() -> None:
    guard, t, path = ready(), 0.0, []
    for k in range(60):
        t += DT
        if k == 15:
            guard.go_gently()
        path.append(guard.check((0.0,) * 6 + (0.8,) * 3, measured(t), 0.0, t).command_rad[6])
    speeds = np.diff(path) / DT
    assert np.abs(np.diff(speeds)).max() / DT <= NECK.accel_rad_s2 + 1e-6
    assert speeds[-1] <= radians(60.0) + 1e-9


def test_a_start_outside_the_range_is_brought_to_its_edge() -> None:
    guard = Guard(GuardParams(), LIMITS)
    guard.reset(0.0, (2.0,) * 9)
    assert guard.check((2.0,) * 9, measured(DT), 0.0, DT).command_rad[0] == EYE.high_rad


def test_time_that_stands_still_moves_nothing() -> None:
    guard = ready()
    guard.check((0.1,) * 9, measured(DT), 0.0, DT)
    again = guard.check((0.2,) * 9, measured(DT), 0.0, DT)
    assert again.level == "hold" and again.reasons == ("all: time stands still",)

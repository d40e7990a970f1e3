"""The guard: whatever is wished, nothing outside any limit leaves."""

from collections import deque
from collections.abc import Iterable
from itertools import pairwise
from math import cos, inf, nan, radians, sin
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from guarded_desk import DT, EYE, LIMITS, NECK, ZERO, guarding, joints_at

from gazerig.robot.model.types import GuardResult
from gazerig.robot.safety.guard import Guard

SLACK = 1e-9


def but(i: int, angle: float, others: float = 0.0) -> tuple[float, ...]:
    """One joint at an angle, all others somewhere else."""
    return tuple(angle if k == i else others for k in range(9))


def driven(
    guard: Guard, wishes: Iterable[tuple[float, ...]], t_s: float = 0.0
) -> list[GuardResult]:
    """Let the joints follow their commands one tick behind."""
    verdicts: list[GuardResult] = []
    position = tuple(guard._motion.command)
    for desired in wishes:
        t_s += DT
        verdicts.append(guard.check(desired, joints_at(position, t_s), 0.0, t_s))
        position = verdicts[-1].command_rad
    return verdicts


def test_a_wish_inside_everything_passes_unchanged() -> None:
    wishes = [(0.05 * (1.0 - cos(2.0 * k * DT)),) * 9 for k in range(1, 400)]
    for desired, verdict in zip(wishes, driven(guarding(), wishes), strict=True):
        assert verdict.command_rad == pytest.approx(desired, abs=1e-12)
        assert verdict.level == "ok" and verdict.reasons == () and verdict.why == ()


def test_whoever_commands_is_told_what_became_of_every_joint() -> None:
    verdict = driven(guarding(), [but(6, radians(51.0), 0.0001)])[0]
    permitted = verdict.command_rad[6]
    assert 0.0 < permitted < radians(0.1)
    assert verdict.applied("neck_yaw") == (radians(51.0), permitted, "out of range")
    assert verdict.applied("left_eye_pan") == (0.0001, 0.0001, "")
    assert verdict.reasons == ("neck_yaw: out of range",)
    with pytest.raises(ValueError, match="no joint 'ear'; available: left_eye_pan, "):
        verdict.applied("ear")


@pytest.mark.parametrize("joint", range(9))
def test_range_is_swept_densely_at_its_edges(joint: int) -> None:
    limit = LIMITS[joint]
    for edge in (limit.low_rad, limit.high_rad):
        for off in [*np.linspace(-0.01, 0.01, 41).tolist(), -1e-12, 1e-12, -2e-9, 2e-9]:
            verdict = driven(guarding(but(joint, edge)), [but(joint, edge + off)])[0]
            assert limit.low_rad <= verdict.command_rad[joint] <= limit.high_rad
            beyond = max(limit.low_rad - edge - off, edge + off - limit.high_rad)
            assert (verdict.applied(GAZE_JOINTS[joint]).reason == "out of range") == (beyond > 1e-9)
            assert verdict.command_rad[joint - 1] == 0.0


@pytest.mark.parametrize("joint", range(9))
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_speed_is_swept_densely_at_its_limit(joint: int, way: float) -> None:
    soft = tuple(limit._replace(accel_rad_s2=1e9) for limit in LIMITS)
    for share in [*np.linspace(0.95, 1.05, 21).tolist(), 1.0 - 1e-12, 1.0 + 1e-6]:
        step = way * LIMITS[joint].speed_rad_s * DT * share
        verdict = driven(guarding(limits=soft), [but(joint, step)])[0]
        assert abs(verdict.command_rad[joint]) <= abs(step / share) * (1.0 + 1e-12)
        assert (verdict.applied(GAZE_JOINTS[joint]).reason == "too fast") == (share > 1.0 + 1e-9)


@pytest.mark.parametrize("joint", range(9))
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_acceleration_is_swept_densely_at_its_limit(joint: int, way: float) -> None:
    for share in [*np.linspace(0.95, 1.05, 21).tolist(), 1.0 - 1e-12]:
        step = way * LIMITS[joint].accel_rad_s2 * DT * DT * share
        verdict = driven(guarding(), [but(joint, step)])[0]
        assert abs(verdict.command_rad[joint]) <= abs(step / share) * (1.0 + 1e-12)
        assert (verdict.applied(GAZE_JOINTS[joint]).reason == "too hard") == (share > 1.0 + 1e-9)


@pytest.mark.parametrize("joint", range(9))
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_braking_before_the_end_of_the_range_is_swept_densely(joint: int, way: float) -> None:
    limit = LIMITS[joint]
    edge = limit.high_rad if way > 0.0 else limit.low_rad
    for share in np.linspace(0.1, 1.0, 10).tolist():
        pace = way * limit.speed_rad_s * share * DT
        began = int(0.9 * (limit.high_rad - limit.low_rad) / abs(pace))
        guard = guarding(but(joint, edge - began * pace))
        wishes = [but(joint, edge + (k - began) * pace) for k in range(began + 40)]
        path = np.array([verdict.command_rad[joint] for verdict in driven(guard, wishes)])
        speeds = np.diff(path, prepend=edge - began * pace) / DT
        assert (np.abs(np.diff(speeds, prepend=0.0)) <= limit.accel_rad_s2 * DT + 1e-6).all()
        assert (way * path <= way * edge).all() and abs(path[-1] - edge) < 1e-3


@pytest.mark.parametrize("joint", [0, 6])
@pytest.mark.parametrize("tick", [0.001, 0.005, 0.02, 0.1])
def test_a_wish_that_jumps_is_met_without_running_past_it(joint: int, tick: float) -> None:
    for jump in np.linspace(-0.5, 0.5, 15).tolist():
        guard, t, path = guarding(), 0.0, [0.0]
        for _ in range(max(40, int(1.5 / tick))):
            t += tick
            state = joints_at(but(joint, path[-1]), t)
            path.append(guard.check(but(joint, jump), state, 0.0, t).command_rad[joint])
        assert path[-1] == pytest.approx(jump, abs=1e-9)
        assert max(abs(p) for p in path) <= abs(jump) + LIMITS[joint].accel_rad_s2 * tick**2


def test_a_wish_that_moves_is_caught_up_with() -> None:
    wishes = [(0.2 + 0.5 * k * DT,) * 9 for k in range(120)]  # a jump, then a steady pace
    last = driven(guarding(), wishes)[-1]
    assert last.level == "ok" and last.command_rad == pytest.approx(wishes[-1])


def test_a_loop_that_was_stopped_goes_on_without_a_leap() -> None:
    guard = guarding()
    guard.check(ZERO, joints_at(ZERO, DT), 0.0, DT)
    verdict = guard.check((0.5,) * 9, joints_at(ZERO, 10.0), 0.0, 10.0)  # ten seconds later
    assert 0.0 < verdict.command_rad[6] <= NECK.speed_rad_s * 0.1
    assert verdict.reasons


def test_not_finite_wishes_hold_and_say_so() -> None:
    for bad in (nan, inf, -inf):
        verdict = guarding().check((bad,) * 9, joints_at(ZERO, DT), 0.0, DT)
        assert verdict.level == "hold"
        assert verdict.command_rad == ZERO
        assert "neck_roll: not finite" in verdict.reasons


@pytest.mark.parametrize("joint", range(9))
def test_ages_of_joints_and_picture_are_swept_densely(joint: int) -> None:
    for off in [*np.linspace(-0.01, 0.01, 21).tolist(), -1e-6, 1e-6, inf, nan]:
        guard, t = guarding(), 1.0
        ages = joints_at(ZERO, t, measured_s=but(joint, t - 0.15 - off, t))
        verdict = guard.check((0.0001,) * 9, ages, 0.0, t)
        stale = not off <= 0.0
        assert (verdict.applied(GAZE_JOINTS[joint]).reason == "stale joints") == stale
        assert verdict.command_rad == but(joint, 0.0 if stale else 0.0001, 0.0001)
        verdict = guarding().check((0.0001,) * 9, joints_at(ZERO, t), 1.5 + off, t)
        assert (verdict.level == "hold") == stale
        moved = stale and joint >= 6
        assert (verdict.applied(GAZE_JOINTS[joint]).reason == "stale frame") == moved
        assert verdict.command_rad[joint] == (0.0 if moved else 0.0001)


def test_a_neck_without_pictures_holds_whatever_is_wished() -> None:
    for wish in (0.0001, 0.5):
        for age_s, held in ((1.499, False), (1.501, True)):
            verdict = guarding().check((wish,) * 9, joints_at(ZERO, DT), age_s, DT)
            assert (verdict.command_rad[6] == 0.0) == held
            assert (verdict.applied("neck_yaw").reason == "stale frame") == held
            assert verdict.command_rad[0] > 0.0


def test_it_starts_slowly_from_where_the_joints_are_until_each_has_met_its_wish() -> None:
    guard = guarding((0.5,) * 9, gentle=True, soft_start_speed_deg_s=60.0)
    path, t = [0.5], 0.0
    while guard.is_gentle and t < 3.0:
        t += DT
        verdict = guard.check(ZERO, joints_at((path[-1],) * 9, t), 0.0, t)
        path.append(verdict.command_rad[0])
    speeds = np.diff(path) / DT
    assert np.abs(speeds).max() <= radians(60.0) + 1e-9
    assert np.abs(np.diff(speeds)).max() / DT <= radians(301.0)
    assert not guard.is_gentle and abs(path[-1]) < radians(1.0) and t >= 1.0
    assert all(b <= a + SLACK for a, b in pairwise(path))
    assert driven(guard, [(0.3,) * 9] * 100, t)[-1].command_rad[0] == pytest.approx(0.3)


def test_going_gently_in_flight_brakes_within_the_joints_own_strength() -> None:
    path: list[Any] = []
    guard, t = guarding(), 0.0
    for k in range(60):
        t += DT
        if k == 15:
            guard.start_gently()
        position = (0.0,) * 6 + ((path[-1] if path else 0.0),) * 3
        desired = (0.0,) * 6 + (0.8,) * 3
        path.append(guard.check(desired, joints_at(position, t), 0.0, t).command_rad[6])
    speeds = np.diff(path) / DT
    assert np.abs(np.diff(speeds)).max() / DT <= NECK.accel_rad_s2 + 1e-6
    assert speeds[-1] <= radians(60.0) + 1e-9


def test_a_start_outside_the_range_is_brought_to_its_edge() -> None:
    guard = guarding((2.0,) * 9, gentle=True)
    assert guard.check((2.0,) * 9, joints_at(ZERO, DT), 0.0, DT).command_rad[0] == EYE.high_rad


def test_time_that_stands_still_moves_nothing() -> None:
    guard = guarding()
    guard.check((0.1,) * 9, joints_at(ZERO, DT), 0.0, DT)
    for odd in (DT, 0.0, nan, inf, -inf):
        again = guard.check((0.2,) * 9, joints_at(ZERO, DT), 0.0, odd)
        assert again.level == "hold" and again.reasons == ("all: time does not advance",)
        assert again.applied("neck_yaw").reason == "time does not advance"
        assert again.command_rad == tuple(guard._motion.command)


# Joints that do not follow commands are found, released, and tried again


STEP = radians(360.0 / 4096.0)


class World:
    """One joint with a dead time, a dead band and, if wanted, a finger that blocks it."""

    def __init__(self, joint: int, lag_s: float = 0.02, band_deg: float = 0.0) -> None:
        self.joint = joint
        self.guard = guarding()
        self.t_s = 0.0
        self.at = 0.0
        self.wall: float | None = None
        self.answered_s = 0.0
        self.path = [0.0]
        self.verdict: GuardResult | None = None
        self._band = radians(band_deg)
        self._sent = deque([0.0] * (round(lag_s / DT) + 1), maxlen=round(lag_s / DT) + 1)

    def tick(self, desired: float, silent: bool = False, dt_s: float = DT) -> str:
        self.t_s += dt_s
        goal = self._sent[0]
        if abs(goal - self.at) > self._band:
            self.at = goal - (self._band if goal > self.at else -self._band)
        if self.wall is not None:
            self.at = min(self.at, self.wall)
        if not silent:
            self.answered_s = self.t_s
            self._seen = round(self.at / STEP) * STEP
        one = [self._seen if k == self.joint else 0.0 for k in range(9)]
        ages = [self.answered_s if k == self.joint else self.t_s for k in range(9)]
        joints = joints_at(one, self.t_s, measured_s=tuple(ages))
        wishes = tuple(desired if k == self.joint else 0.0 for k in range(9))
        self.verdict = self.guard.check(wishes, joints, 0.0, self.t_s)
        self.path.append(self.verdict.command_rad[self.joint])
        self._sent.append(self.path[-1])
        return self.verdict.applied(GAZE_JOINTS[self.joint]).reason


@pytest.mark.parametrize("joint", range(9))
@pytest.mark.parametrize("lag_s", [0.0, 0.015, 0.03])
def test_a_jammed_joint_is_found_within_200_ms_and_let_go(joint: int, lag_s: float) -> None:
    world = World(joint, lag_s)
    for _ in range(20):
        world.tick(0.0)
    world.wall = 0.0
    began_s = None
    while world.tick(0.5) != "not moving":
        if began_s is None and world.path[-1] > radians(3.0):
            began_s = world.t_s
        assert world.t_s < 1.0
    assert began_s is not None and world.t_s - began_s <= 0.200
    assert world.verdict is not None and world.verdict.level == "hold"
    peak = len(world.path)
    for _ in range(100):
        assert world.tick(0.5) == "not moving"
    assert abs(world.path[-1]) <= STEP
    speeds = np.diff(world.path) / DT
    limit = LIMITS[joint]
    assert np.abs(np.diff(speeds, prepend=0.0)).max() <= limit.accel_rad_s2 * DT + 1e-6
    assert np.abs(speeds).max() <= limit.speed_rad_s + 1e-9
    assert min(world.path[peak:]) >= -STEP  # and not pulled back


def test_a_joint_that_is_met_on_its_way_gives_way_too() -> None:
    world = World(6)
    world.wall = radians(12.0)
    while world.tick(0.6) != "not moving":
        assert world.t_s < 1.0
    for _ in range(120):
        world.tick(0.6)
    assert world.path[-1] == pytest.approx(radians(12.0), abs=STEP)
    world.wall = radians(5.0)  # pushed back: it yields once more
    for _ in range(60):
        world.tick(0.6)
    assert world.path[-1] == pytest.approx(radians(5.0), abs=STEP)


def test_it_tries_again_slowly_and_pushes_weakly_until_the_way_is_free() -> None:
    world = World(6)
    world.wall = radians(12.0)
    reasons = [world.tick(0.6) for _ in range(1000)]
    found = [k for k, (a, b) in enumerate(zip(reasons, reasons[1:], strict=False)) if a != b]
    assert len(found) >= 6
    first = reasons.index("not moving")
    again = reasons.index("starting slowly")
    assert (again - first) * DT == pytest.approx(1.0, abs=2 * DT)
    assert max(world.path[again:]) <= radians(12.0 + 4.5) + STEP
    speeds = np.diff(world.path[again:]) / DT
    assert speeds.max() <= radians(60.0) + 1e-9
    world.wall = None
    for _ in range(800):
        last = world.tick(0.6)
    assert last == "" and world.path[-1] == pytest.approx(0.6)


@pytest.mark.parametrize("joint", [0, 4, 6])
@pytest.mark.parametrize("lag_s", [0.0, 0.015, 0.03])
@pytest.mark.parametrize("band_deg", [0.0, 0.6, 1.0])
def test_healthy_joints_are_left_alone(joint: int, lag_s: float, band_deg: float) -> None:
    world = World(joint, lag_s, band_deg)
    rng = np.random.default_rng(5)
    desired = 0.0
    for k in range(1600):
        if k < 600:  # saccades, large and small, some there and back at once
            desired = float(rng.uniform(-0.55, 0.55)) if rng.random() < 0.05 else desired
        elif k < 1000:  # slow pursuit
            desired = 0.3 * sin(0.6 * k * DT)
        elif k < 1200:  # friction swallows it
            desired = radians(0.4) * (k // 40 % 2)
        else:  # a tremor
            desired = radians(5.0) * sin(40.0 * k * DT)
        silent = rng.random() < 0.3 or 700 < k < 725
        dt_s = DT if k % 50 else 0.08  # now and then the loop is late
        assert world.tick(desired, silent, dt_s) != "not moving"


def test_a_slow_start_is_no_jam() -> None:
    world = World(6, 0.03, 0.6)
    world.guard.start_gently()
    for k in range(600):
        if k == 300:
            world.guard.start_gently()
        assert world.tick(0.5 if k < 300 else -0.5) != "not moving"


@pytest.mark.parametrize("off_deg", np.linspace(2.5, 3.5, 21).tolist())
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_distance_is_swept_densely(off_deg: float, way: float) -> None:
    guard, found = guarding(), False
    for k in range(1, 60):
        joints = joints_at((-way * radians(off_deg),) * 9, k * DT)
        verdict = guard.check(ZERO, joints, 0.0, k * DT)
        found = found or verdict.level == "hold"
        assert not found or set(verdict.why) == {"not moving"}
    assert found == (off_deg > 3.0 + 1e-9)


@pytest.mark.parametrize("creep_deg_s", [1.0, 2.5, 3.0, 3.7, 4.0, 6.0, -1.0, -6.0, -20.0])
def test_only_motion_towards_the_command_counts(creep_deg_s: float) -> None:
    guard, found = guarding((0.6,) * 9), False
    for k in range(1, 100):
        at = radians(5.0 + creep_deg_s * k * DT)
        joints = joints_at((at,) * 9, k * DT)
        found = found or guard.check((0.6,) * 9, joints, 0.0, k * DT).level == "hold"
    assert found == (creep_deg_s < 0.5 / 0.15)


def test_a_silent_joint_is_stale_and_not_stuck() -> None:
    world = World(6)
    world.tick(0.0)
    world.wall = 0.0
    reasons = {world.tick(0.5, silent=True) for _ in range(100)}
    assert "stale joints" in reasons and "not moving" not in reasons


def test_a_stuck_joint_lets_the_others_move() -> None:
    guard = guarding(gentle=True)
    command: tuple[float, ...] = ZERO
    verdict = None
    for k in range(1, 500):
        joints = joints_at((0.0, *command[1:]), k * DT)
        verdict = guard.check((0.3,) * 9, joints, 0.0, k * DT)
        command = verdict.command_rad
    assert verdict is not None and command[1:] == pytest.approx((0.3,) * 8)
    assert abs(command[0]) < radians(4.6)

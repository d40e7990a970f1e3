"""The guard: whatever is wished, nothing outside any limit leaves."""

from collections import deque
from collections.abc import Callable, Iterable
from itertools import pairwise
from math import degrees, inf, nan, radians, sin
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from gaze_targets import joints_at
from guarded_desk import DT, LIMITS, NECK, ZERO, guarding

from gazerig.config.validation import validate
from gazerig.robot.model.guard_params import CollisionParams, GuardParams
from gazerig.robot.model.types import GuardResult
from gazerig.robot.safety.guard import LATE_RAD_S2, SOFT_START_RAD_S2, Guard

SLACK = 1e-9
EACH_KIND = (0, 5, 8)
"""The first joint, a lid and the last joint: those between have the limits of one of them."""


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


def reason_of(verdict: GuardResult, joint: str) -> str:
    """Return why the guard changed a joint's angle, "" if it did not."""
    return verdict.why[verdict.joints.index(joint)] if verdict.why else ""


@pytest.mark.parametrize("joint", EACH_KIND)
def test_range_is_swept_densely_at_its_edges(joint):
    limit = LIMITS[joint]
    for edge in (limit.low_rad, limit.high_rad):
        for off in [*np.linspace(-0.01, 0.01, 41).tolist(), -1e-12, 1e-12, -2e-9, 2e-9]:
            verdict = driven(guarding(but(joint, edge)), [but(joint, edge + off)])[0]
            assert limit.low_rad <= verdict.command_rad[joint] <= limit.high_rad
            beyond = max(limit.low_rad - edge - off, edge + off - limit.high_rad)
            assert (reason_of(verdict, GAZE_JOINTS[joint]) == "out of range") == (beyond > 1e-9)
            assert verdict.command_rad[joint - 1] == 0.0


WISHES = "0.0375 | 0.0376 too_hard | 0.999 too_hard | 1.001 too_fast | 50.1 out_of_range"
"""In a tick of 5 ms a neck at rest moves by 0.0375 deg, and at most by 1 deg."""


@pytest.mark.parametrize("case", WISHES.split("|"))
@pytest.mark.parametrize("way", [1.0, -1.2])
def test_a_wish_is_shortened_for_one_reason(case, way):
    off, _, reason = case.strip().replace("_", " ").partition(" ")
    wish = radians(float(off)) * (way if reason == "out of range" else way / abs(way))
    (verdict,) = driven(guarding(), [but(6, wish)])
    assert reason_of(verdict, "neck_yaw") == reason and verdict.desired_rad[6] == wish
    moved = min(abs(wish), radians(0.0375)) * way / abs(way)
    assert verdict.command_rad == pytest.approx(but(6, moved), abs=1e-12)
    assert verdict.level == ("limited" if reason else "ok")


@pytest.mark.parametrize("joint", EACH_KIND)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_speed_is_swept_densely_at_its_limit(joint, way):
    soft = tuple(limit._replace(accel_rad_s2=1e9) for limit in LIMITS)
    for share in [*np.linspace(0.95, 1.05, 21).tolist(), 1.0 - 1e-12, 1.0 + 1e-6]:
        step = way * LIMITS[joint].speed_rad_s * DT * share
        verdict = driven(guarding(limits=soft), [but(joint, step)])[0]
        assert abs(verdict.command_rad[joint]) <= abs(step / share) * (1.0 + 1e-12)
        assert (reason_of(verdict, GAZE_JOINTS[joint]) == "too fast") == (share > 1.0 + 1e-9)


@pytest.mark.parametrize("joint", EACH_KIND)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_acceleration_is_swept_densely_at_its_limit(joint, way):
    for share in [*np.linspace(0.95, 1.05, 21).tolist(), 1.0 - 1e-12]:
        step = way * LIMITS[joint].accel_rad_s2 * DT * DT * share
        verdict = driven(guarding(), [but(joint, step)])[0]
        assert abs(verdict.command_rad[joint]) <= abs(step / share) * (1.0 + 1e-12)
        assert (reason_of(verdict, GAZE_JOINTS[joint]) == "too hard") == (share > 1.0 + 1e-9)


@pytest.mark.parametrize("joint", EACH_KIND)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_braking_before_the_end_of_the_range_is_swept_densely(joint, way):
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
def test_a_wish_that_jumps_is_met_without_running_past_it(joint, tick):
    for jump in np.linspace(-0.5, 0.5, 5).tolist():
        guard, t, path = guarding(), 0.0, [0.0]
        for _ in range(max(40, int(1.5 / tick))):
            t += tick
            state = joints_at(but(joint, path[-1]), t)
            path.append(guard.check(but(joint, jump), state, 0.0, t).command_rad[joint])
        assert path[-1] == pytest.approx(jump, abs=1e-9)
        assert max(abs(p) for p in path) <= abs(jump) + LIMITS[joint].accel_rad_s2 * tick**2


def test_not_finite_wishes_hold_and_say_so():
    for bad in (nan, inf, -inf):
        verdict = guarding().check((bad,) * 9, joints_at(ZERO, DT), 0.0, DT)
        assert verdict.level == "hold"
        assert verdict.command_rad == ZERO
        assert "neck_roll: not finite" in verdict.reasons


@pytest.mark.parametrize("joint", EACH_KIND)
def test_ages_of_joints_and_picture_are_swept_densely(joint):
    for off in [*np.linspace(-0.01, 0.01, 21).tolist(), -1e-6, 1e-6, inf, nan]:
        guard, t = guarding(), 1.0
        ages = joints_at(ZERO, t, measured_s=but(joint, t - 0.15 - off, t))
        verdict = guard.check((0.0001,) * 9, ages, 0.0, t)
        stale = not off <= 0.0
        assert (reason_of(verdict, GAZE_JOINTS[joint]) == "stale joints") == stale
        assert verdict.command_rad == but(joint, 0.0 if stale else 0.0001, 0.0001)
        verdict = guarding().check((0.0001,) * 9, joints_at(ZERO, t), 1.5 + off, t)
        assert (verdict.level == "hold") == stale
        moved = stale and joint >= 6
        assert (reason_of(verdict, GAZE_JOINTS[joint]) == "stale frame") == moved
        assert verdict.command_rad[joint] == (0.0 if moved else 0.0001)


def test_it_starts_slowly_from_where_the_joints_are_until_each_has_met_its_wish():
    guard = guarding((0.5,) * 9, gentle=True, soft_start_speed_deg_s=60.0)
    path, t = [0.5], 0.0
    while any(guard._gentle) and t < 3.0:
        t += DT
        verdict = guard.check(ZERO, joints_at((path[-1],) * 9, t), 0.0, t)
        path.append(verdict.command_rad[0])
    speeds = np.diff(path) / DT
    assert np.abs(speeds).max() <= radians(60.0) + 1e-9
    assert np.abs(np.diff(speeds)).max() / DT <= radians(301.0)
    assert not any(guard._gentle) and abs(path[-1]) < radians(1.0)
    assert t == pytest.approx(1.0, abs=1.1 * DT)
    assert all(b <= a + SLACK for a, b in pairwise(path))
    assert driven(guard, [(0.3,) * 9] * 100, t)[-1].command_rad[0] == pytest.approx(0.3)


def test_going_gently_in_flight_brakes_within_the_joints_own_strength():
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


def test_time_that_stands_still_moves_nothing():
    guard = guarding()
    guard.check((0.1,) * 9, joints_at(ZERO, DT), 0.0, DT)
    new = Guard(GuardParams(), LIMITS, GAZE_JOINTS).check(ZERO, joints_at(ZERO), 0.0, 0.0)
    assert new.command_rad == pytest.approx((0.0,) * 6 + (radians(-5.0),) * 3)
    for odd in (DT, 0.0, nan, inf, -inf):
        again = guard.check((0.2,) * 9, joints_at(ZERO, DT), 0.0, odd)
        assert again.level == "hold" and again.reasons == ("all: time does not advance",)
        assert reason_of(again, "neck_yaw") == "time does not advance"
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
        return reason_of(self.verdict, GAZE_JOINTS[self.joint])


@pytest.mark.parametrize("joint", EACH_KIND)
@pytest.mark.parametrize("lag_s", [0.0, 0.015, 0.03])
def test_a_jammed_joint_is_found_within_200_ms_and_let_go(joint, lag_s):
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


def test_a_joint_that_is_met_on_its_way_gives_way_too():
    world = World(6)
    world.wall = radians(12.0)
    while world.tick(0.6) != "not moving":
        assert world.t_s < 1.0
    for _ in range(60):
        world.tick(0.6)
    assert world.path[-1] == pytest.approx(radians(12.0), abs=STEP)
    world.wall = radians(11.0)  # it does not sink with the joint
    for _ in range(20):
        world.tick(0.6)
    assert world.path[-1] == pytest.approx(radians(12.0), abs=STEP)
    world.wall = radians(5.0)  # pushed back: it yields once more
    for _ in range(60):
        world.tick(0.6)
    assert world.path[-1] == pytest.approx(radians(5.0), abs=STEP)


def test_it_tries_again_slowly_and_pushes_weakly_until_the_way_is_free():
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
def test_healthy_joints_are_left_alone(joint, lag_s, band_deg):
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


def test_a_slow_start_is_no_jam():
    world = World(6, 0.03, 0.6)
    world.guard.start_gently()
    for k in range(600):
        if k == 300:
            world.guard.start_gently()
        assert world.tick(0.5 if k < 300 else -0.5) != "not moving"


def test_a_silent_joint_is_stale_and_not_stuck():
    world = World(6)
    world.tick(0.0)
    world.wall = 0.0
    reasons = {world.tick(0.5, silent=True) for _ in range(100)}
    assert "stale joints" in reasons and "not moving" not in reasons


# --- Heat, load, voltage, torque and latched faults: slower first, then still, then limp


JOINT = 6
NAME = GAZE_JOINTS[JOINT]


def test_a_stuck_joint_lets_the_others_move():
    guard = guarding(gentle=True)
    command: tuple[float, ...] = ZERO
    verdict = None
    for k in range(1, 500):
        joints = joints_at((0.0, *command[1:]), k * DT)
        verdict = guard.check((0.3,) * 9, joints, 0.0, k * DT)
        command = verdict.command_rad
    assert verdict is not None and command[1:] == pytest.approx((0.3,) * 8)
    assert abs(command[0]) < radians(4.6)


class ServoWorld:
    """Joints that follow their commands one tick later, with given feedback of servos."""

    def __init__(self) -> None:
        self.guard = guarding()
        self.t_s = 0.0
        self.position = [0.0] * 9
        self.path = [0.0]

    def tick(self, desired: float, *, stray: float | None = None, **said: object) -> GuardResult:
        """One tick with the joint commanded to ``desired``; stray: its true place."""
        self.t_s += DT
        at = list(self.position)
        if stray is not None:
            at[JOINT] = stray
        columns: dict[str, Any] = {
            name: tuple(one if k == JOINT else self._usual(name) for k in range(9))
            for name, one in said.items()
        }
        wishes = tuple(desired if k == JOINT else 0.0 for k in range(9))
        verdict = self.guard.check(wishes, joints_at(at, self.t_s, **columns), 0.0, self.t_s)
        self.position = list(verdict.command_rad)
        self.path.append(verdict.command_rad[JOINT])
        return verdict

    @staticmethod
    def _usual(name: str) -> object:
        usual = {"torque": True, "fault": "", "load": 0.0, "temperature_c": 40.0}
        return {**usual, "voltage_v": 5.0, "rearmed": False}[name]

    def speeds(self) -> np.ndarray:
        return np.diff(self.path) / DT


def reason(verdict: GuardResult) -> str:
    return reason_of(verdict, NAME)


@pytest.fixture
def world() -> ServoWorld:
    return ServoWorld()


@pytest.mark.parametrize("celsius", np.linspace(50.0, 75.0, 26).tolist())
def test_heat_slows_a_joint_down_before_it_stops_it(world, celsius):
    small = [world.tick(1e-4, temperature_c=celsius).level for _ in range(40)]
    assert small[-1] == ("ok" if celsius < 65.0 else "hold")
    verdicts = [world.tick(0.5, temperature_c=celsius) for _ in range(60)]
    share = min(max(1.0 - 0.8 * (celsius - 55.0) / 10.0, 0.0), 1.0)
    speeds = world.speeds()
    if celsius >= 65.0:
        assert (verdicts[-1].level, reason(verdicts[-1])) == ("hold", "hot")
        assert world.path[-1] == 0.0
        return
    assert speeds.max() == pytest.approx(share * NECK.speed_rad_s, rel=0.03)
    assert speeds.max() <= share * NECK.speed_rad_s + 1e-9
    assert np.diff(speeds, prepend=0.0).max() <= share * NECK.accel_rad_s2 * DT + 1e-9
    assert reason(verdicts[5]) == ("hot" if celsius > 55.0 else "too fast")
    assert verdicts[5].reasons == (f"{NAME}: {reason(verdicts[5])}",)  # and no one else
    assert verdicts[5].level == "limited"


def test_a_hot_joint_goes_on_slowly_when_it_has_cooled(world):
    said = [66.0, 65.0, 64.0, 63.0, 62.0]
    verdicts = [world.tick(0.5, temperature_c=celsius) for celsius in said]
    assert [reason(verdict) for verdict in verdicts] == ["hot"] * 4 + ["starting slowly"]


def test_full_load_is_let_go_before_the_servo_would(world):
    verdict = world.tick(0.0, load=0.0)
    while verdict.level != "hold":
        verdict = world.tick(0.08, stray=0.03, load=0.9)  # pushed by less than a stuck joint is
    assert world.t_s < 1.0
    for _ in range(60):
        verdict = world.tick(0.08, stray=0.16, load=0.9)
        assert reason(verdict) == "overloaded"
    assert verdict.command_rad[JOINT] == pytest.approx(0.16)
    assert np.abs(np.diff(world.speeds())).max() <= NECK.accel_rad_s2 * DT + 1e-9
    full_s = world.t_s
    while verdict.level == "hold":
        verdict = world.tick(0.08, stray=verdict.command_rad[JOINT], load=0.1)
    assert reason(verdict) == "starting slowly" and world.t_s - full_s > 1.0


def test_torque_off_holds_and_goes_along_with_the_joint(world):
    for k in range(100):  # turned by hand at 57 deg/s, then let go
        where = min(0.005 * k, 0.3)
        verdict = world.tick(-0.2, stray=where, torque=False)
        assert (verdict.level, reason(verdict)) == ("hold", "torque off")
    assert verdict.command_rad[JOINT] == pytest.approx(0.3)
    verdict = world.tick(-0.2, torque=True)
    assert reason(verdict) == "starting slowly"
    assert 0.3 - verdict.command_rad[JOINT] <= radians(300.0) * DT * DT + 1e-9


@pytest.mark.parametrize("torque", [{"torque": False}, {}])
def test_a_latched_fault_is_limp_with_its_words(world, torque):
    for _ in range(80):
        verdict = world.tick(0.5, stray=0.1, fault="overload and input voltage", **torque)
        assert verdict.level == "torque_off"
        assert verdict.reasons == (f"{NAME}: overload and input voltage",)
    assert verdict.command_rad[JOINT] == pytest.approx(0.1)


def test_the_gravest_reasons_stand_by_themselves():
    guard = guarding(gentle=True)
    fault = tuple("overload" if k == JOINT else "" for k in range(9))
    joints = joints_at(ZERO, DT, fault=fault)
    verdict = guard.check((0.5,) * 9, joints, 0.0, DT)
    assert len(verdict.reasons) == 9 and verdict.critical_reasons == (f"{NAME}: overload",)
    assert ServoWorld().tick(0.0).critical_reasons == ()


def test_what_still_moves_with_a_fault_moves_slowly_and_the_others_as_they_should(world):
    for _ in range(100):
        verdict = world.tick(0.5, fault="input voltage", torque=True)
        assert verdict.level == "torque_off" and reason(verdict) == "input voltage"
    assert 0.0 < world.speeds().max() <= radians(60.0) + 1e-9
    assert ServoWorld().tick(0.5, fault="encoder", torque=True).command_rad[JOINT] == 0.0


def test_a_reset_begins_anew():
    guard, hot = guarding((0.1,) * 9), {"temperature_c": (66.0,) * 9}
    for k in range(1, 60):  # hot, and far from its command
        verdict = guard.check(ZERO, joints_at((0.3,) * 9, k * DT, **hot), 0.0, k * DT)
    assert set(verdict.why) == {"not moving"}
    narrow = (NECK._replace(low_rad=-0.3, high_rad=0.3),) * 9
    guard.retune(GuardParams(), narrow)
    guard.reset(k * DT, ZERO)
    assert guard.limits == narrow
    t_s = (k + 1) * DT
    warm = joints_at(ZERO, t_s, temperature_c=(64.0,) * 9)
    assert set(guard.check((0.2,) * 9, warm, 0.0, t_s).why) == {"starting slowly"}
    guard = guarding(limits=(NECK,) * 9, gentle=True, period_s=DT)
    t_s, at = 0.0, [0.0]
    for k in range(50):  # a late tick at full slow speed, then slowly again from there
        t_s += DT if k != 48 else 5 * DT
        at.append(guard.check((0.8,) * 9, joints_at(at[-1:] * 9, t_s), 0.0, t_s).command_rad[0])
        if k == 48:
            guard.start_gently()
    assert at[-1] - 2.0 * at[-2] + at[-3] <= radians(300.0) * DT * DT + 1e-9


def test_a_rearmed_joint_begins_where_it_is(world):
    gentle = [reason(world.tick(0.0, rearmed=k == 0)) for k in range(250)]
    assert gentle.count("starting slowly") == pytest.approx(1.0 / DT, abs=1.1)
    for _ in range(40):
        world.tick(0.4)
    verdict = world.tick(0.4, stray=-0.25, rearmed=True)
    assert reason(verdict) == "starting slowly"
    assert abs(verdict.command_rad[JOINT] + 0.25) <= radians(300.0) * DT * DT + 1e-9
    began = len(world.path)
    while reason(verdict) == "starting slowly":
        verdict = world.tick(0.4)
    speeds = np.diff(world.path[began:]) / DT
    assert speeds.max() <= radians(60.0) + 1e-9 and verdict.command_rad[JOINT] > 0.38
    world.tick(0.4, stray=3.0, rearmed=True)
    assert NECK.high_rad - 1e-3 <= world.path[-1] <= NECK.high_rad
    assert np.isfinite(world.tick(0.4, stray=nan, rearmed=True).command_rad).all()


# --- Late ticks: joints go on from their goals softly; and servos that tell no angle


LOW, HIGH, TOP, ACCEL = NECK[:4]


def test_a_joint_whose_ticks_do_not_come_goes_on_from_its_goal_softly():
    accel = 3.0 * LATE_RAD_S2
    limit = NECK._replace(speed_rad_s=radians(900.0), accel_rad_s2=accel)
    for missed in (2, 10, 400):
        guard = guarding((LOW,) * 9, (limit,) * 9, period_s=DT)
        t_s, before, speed = 0.0, LOW, 0.0
        for k in range(20):
            t_s += DT if k != 8 else missed * DT
            joints = joints_at((before,) * 9, t_s)
            verdict = guard.check((HIGH,) * 9, joints, 0.0, t_s)
            now = verdict.command_rad[0]
            if k not in (18, 19):
                assert ("late tick" in verdict.why[0]) == (8 <= k < 18)
            assert k < 19 or verdict.why[0] in ("too fast", "too hard")
            if 8 <= k < 18:
                braked = max(0.0, speed - accel * (missed - 1) * DT) if k == 8 else speed
                assert (now - before) / DT <= braked + LATE_RAD_S2 * DT + 1e-9
            before, speed = now, (now - before) / DT


def test_a_slow_joint_regains_its_speed_after_late_ticks_and_no_more():
    """Every third tick misses two slots."""
    guard = guarding((LOW,) * 9, (NECK,) * 9, True, DT, soft_start_speed_deg_s=20.0)
    t_s, before, fastest, last = 0.0, LOW, 0.0, 0.0
    for k in range(1, 400):
        gap = 2 * (k % 3 == 0)
        t_s += (1 + gap) * DT
        now = guard.check((HIGH,) * 9, joints_at((before,) * 9, t_s), 0.0, t_s).command_rad[0]
        speed, before = (now - before) / DT, now
        assert speed <= min(radians(20.0), fastest + SOFT_START_RAD_S2 * DT) + 1e-9
        assert abs(speed - max(0.0, last - ACCEL * gap * DT)) <= ACCEL * DT + 1e-9
        fastest, last = max(fastest, speed), speed
    assert now > LOW + 0.2


def test_a_servo_without_feedback_is_never_found_stalled():
    guard = guarding(limits=(NECK,) * 9, gentle=True)
    for k in range(1, 200):
        joints = joints_at(ZERO, k * DT, measured=(False,) * 9)
        verdict = guard.check((0.4,) * 9, joints, 0.0, k * DT)
        assert reason_of(verdict, "neck_yaw") != "not moving"


# --- Forbidden pairs of joint ranges: never entered, never crossed, left gently


LEFT, PITCH = (GAZE_JOINTS.index(n) for n in ("left_upper_lid", "neck_pitch"))
LID = CollisionParams(("neck_pitch", -30.0, -18.0), ("left_upper_lid", 10.0, 25.0))


class PairWorld:
    """Joints one tick behind their commands."""

    def __init__(self, *pairs: CollisionParams, **start_deg: float) -> None:
        start = tuple(radians(start_deg.get(name, 0.0)) for name in GAZE_JOINTS)
        self.guard = guarding(start, gentle=True, collisions=pairs)
        self.t_s = 0.0
        self.path = [start]
        self.measured: Callable[[tuple[float, ...]], tuple[float, ...]] = lambda angles: angles

    def awake(self) -> "PairWorld":
        self.guard._gentle = [False] * 9
        return self

    def tick(self, dt_s: float = DT, **desired_deg: float) -> GuardResult:
        self.t_s += dt_s
        joints = joints_at(self.measured(self.path[-1]), self.t_s)
        desired = tuple(radians(desired_deg.get(name, 0.0)) for name in GAZE_JOINTS)
        verdict = self.guard.check(desired, joints, 0.0, self.t_s)
        self.path.append(verdict.command_rad)
        return verdict

    def angle(self, joint: int) -> float:
        return degrees(self.path[-1][joint])


def test_one_joint_waits_at_its_wall_and_the_other_is_free():
    world = PairWorld(LID).awake()
    for _ in range(400):
        verdict = world.tick(neck_pitch=-25.0, left_upper_lid=20.0)
    assert world.angle(PITCH) == pytest.approx(-17.0) and world.angle(LEFT) == pytest.approx(20.0)
    assert verdict.reasons == ("neck_pitch: self-collision",) and verdict.level == "limited"
    for _ in range(400):  # the lid makes room
        verdict = world.tick(neck_pitch=-25.0, left_upper_lid=0.0)
    assert world.angle(PITCH) == pytest.approx(-25.0) and verdict.level == "ok"
    for _ in range(400):
        verdict = world.tick(neck_pitch=-25.0, left_upper_lid=20.0)
    assert world.angle(LEFT) == pytest.approx(9.0) and world.angle(PITCH) == pytest.approx(-25.0)
    assert verdict.reasons == ("left_upper_lid: self-collision",)


@pytest.mark.parametrize("pitch", [-29.9, -24.0, -18.1])
@pytest.mark.parametrize("lid", [10.1, 17.0, 24.9])
def test_who_begins_in_a_box_is_led_out_gently(pitch, lid):
    world = PairWorld(LID, neck_pitch=pitch, left_upper_lid=lid)
    verdict = world.tick(neck_pitch=pitch, left_upper_lid=lid)
    assert verdict.level == "hold"
    collide = {"neck_pitch: self-collision", "left_upper_lid: self-collision"}
    assert {one for one in verdict.reasons if "slowly" not in one} == collide
    out = [
        p for p in range(400) if world.tick(neck_pitch=pitch, left_upper_lid=lid).level == "hold"
    ]
    assert 0 < len(out) < 399
    path = np.degrees(np.array(world.path))[:, [PITCH, LEFT]]
    speeds = np.diff(path[: len(out)], axis=0) / DT
    assert np.abs(speeds).max() <= 60.0 + 1e-6
    assert np.abs(np.diff(speeds, axis=0, prepend=0.0)).max() <= 301.0 * DT
    assert (np.ptp(path[: len(out)], axis=0) == 0.0).sum() == 1  # the other one waits
    pitch, lid = path[-1]
    assert not (-30.0 <= pitch <= -18.0 and 10.0 <= lid <= 25.0)


def test_a_rearmed_joint_inside_a_box_is_led_out():
    world = PairWorld(LID).awake()
    for _ in range(100):
        world.tick(left_upper_lid=20.0)
    world.t_s += DT
    at = (*world.path[-1][:PITCH], radians(-19.0), *world.path[-1][PITCH + 1 :])
    again = tuple(k == PITCH for k in range(9))
    joints = joints_at(at, world.t_s, rearmed=again)
    verdict = world.guard.check(ZERO, joints, 0.0, world.t_s)
    assert reason_of(verdict, "neck_pitch") == "self-collision"
    world.path.append(verdict.command_rad)
    for _ in range(10):  # the other one waits, whatever it is to do
        world.tick(left_upper_lid=20.05)
        assert world.angle(LEFT) == pytest.approx(20.0, abs=1e-9)
    for _ in range(400):
        verdict = world.tick(left_upper_lid=20.0)
    assert verdict.level == "ok"


def test_pairs_come_from_the_rig_file_and_wrong_ones_are_refused():
    pair = {"first": ("neck_pitch", -30, -18), "second": ("left_upper_lid", 10, 25)}
    params, errors = validate(GuardParams, {"collisions": (pair,)})
    assert errors == [] and params is not None and params.collisions == (LID,)
    wrong: list[tuple[dict[str, object], str]] = [
        ({"second": ("neck_pitch", 10, 25)}, "first and second are both neck_pitch"),
        ({"first": ("neck_pitch", -30, -30)}, "neck_pitch: -30 must be below -30"),
    ]
    for change, says in wrong:
        params, errors = validate(GuardParams, {"collisions": ({**pair, **change},)})
        assert params is None and len(errors) == 1
        assert says in errors[0].rule


def test_a_pair_that_leaves_no_pose_is_refused():
    whole = CollisionParams(("neck_pitch", -60.0, 50.0), ("left_upper_lid", -34.5, 34.5))
    with pytest.raises(ValueError, match="neck_pitch -60..50 deg of -60..50 with left_upper_lid"):
        guarding(collisions=(whole,))

"""Joints that are told to move and do not are found, let go, and tried again."""

from collections import deque
from math import radians, sin

import numpy as np
import pytest
from desk import GAZE_JOINTS

from gazerig.robot.model.guard_params import GuardParams, StallParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import GuardResult, JointState
from gazerig.robot.safety.guard import Guard

EYE = JointLimit(radians(-35), radians(35), radians(600), radians(45_000))
NECK = JointLimit(radians(-60), radians(50), radians(200), radians(1_500))
LIMITS = (EYE,) * 6 + (NECK,) * 3
DT = 0.005
STEP = radians(360.0 / 4096.0)


class World:
    """One joint with a dead time, a dead band and, if wanted, a finger in its way."""

    def __init__(self, joint: int, lag_s: float = 0.02, band_deg: float = 0.0) -> None:
        self.joint = joint
        self.guard = Guard(GuardParams(), LIMITS, GAZE_JOINTS)
        self.guard.reset(0.0, (0.0,) * 9)
        self.guard._gentle = [False] * 9
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
        joints = JointState(tuple(one), (0.0,) * 9, tuple(ages), ())
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
    assert min(world.path[peak:]) >= -STEP  # and not pulled the other way


def test_a_joint_that_is_met_on_its_way_gives_way_too() -> None:
    world = World(6)
    world.wall = radians(12.0)
    while world.tick(0.6) != "not moving":
        assert world.t_s < 1.0
    for _ in range(120):
        world.tick(0.6)
    assert world.path[-1] == pytest.approx(radians(12.0), abs=STEP)
    world.wall = radians(5.0)  # pushed back: it gives way once more
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
    world.guard.go_gently()
    for k in range(600):
        if k == 300:
            world.guard.go_gently()
        assert world.tick(0.5 if k < 300 else -0.5) != "not moving"


@pytest.mark.parametrize("off_deg", np.linspace(2.5, 3.5, 21).tolist())
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_distance_is_swept_densely(off_deg: float, way: float) -> None:
    guard = Guard(GuardParams(), LIMITS, GAZE_JOINTS)
    guard.reset(0.0, (0.0,) * 9)
    guard._gentle = [False] * 9
    found = False
    for k in range(1, 60):
        joints = JointState((-way * radians(off_deg),) * 9, (0.0,) * 9, (k * DT,) * 9, ())
        verdict = guard.check((0.0,) * 9, joints, 0.0, k * DT)
        found = found or verdict.level == "hold"
        assert not found or set(verdict.why) == {"not moving"}
    assert found == (off_deg > 3.0 + 1e-9)


@pytest.mark.parametrize("creep_deg_s", [1.0, 2.5, 3.0, 3.7, 4.0, 6.0, -1.0, -6.0, -20.0])
def test_only_motion_towards_the_command_counts(creep_deg_s: float) -> None:
    guard = Guard(GuardParams(), LIMITS, GAZE_JOINTS)
    guard.reset(0.0, (0.6,) * 9)
    guard._gentle = [False] * 9
    found = False
    for k in range(1, 100):
        at = radians(5.0 + creep_deg_s * k * DT)
        joints = JointState((at,) * 9, (0.0,) * 9, (k * DT,) * 9, ())
        found = found or guard.check((0.6,) * 9, joints, 0.0, k * DT).level == "hold"
    assert found == (creep_deg_s < 0.5 / 0.15)


def test_a_silent_joint_is_stale_and_not_stuck() -> None:
    world = World(6)
    world.tick(0.0)
    world.wall = 0.0
    reasons = {world.tick(0.5, silent=True) for _ in range(100)}
    assert "stale joints" in reasons and "not moving" not in reasons


def test_a_stuck_joint_lets_the_others_move() -> None:
    guard = Guard(GuardParams(), LIMITS, GAZE_JOINTS)
    guard.reset(0.0, (0.0,) * 9)
    command: tuple[float, ...] = (0.0,) * 9
    verdict = None
    for k in range(1, 500):
        joints = JointState((0.0, *command[1:]), (0.0,) * 9, (k * DT,) * 9, ())
        verdict = guard.check((0.3,) * 9, joints, 0.0, k * DT)
        command = verdict.command_rad
    assert verdict is not None and command[1:] == pytest.approx((0.3,) * 8)
    assert abs(command[0]) < radians(4.6)


def test_params_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match="retry_deg 3.0 must be above position_error_deg 3.0"):
        StallParams(retry_deg=3.0)
    with pytest.raises(ValueError, match="moved_deg 3.0 must be below position_error_deg 3.0"):
        StallParams(moved_deg=3.0)

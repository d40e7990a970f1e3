"""Limits changed at random in full flight: every command keeps those in force, and new ones come.

The commands are judged by themselves, tick by tick, without the guard's own arithmetic.
"""

from math import radians

import numpy as np
import pytest
from desk import GAZE_JOINTS
from numpy.typing import NDArray

from gazerig.robot.model.forbidden_range import CollisionParams
from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JointState
from gazerig.robot.safety.guard import Guard

DT_S = 0.005
GENTLE = GuardParams(soft_start_ms=50.0)
BOX = CollisionParams("neck_pitch", -60.0, -30.0, "left_upper_lid", 40.0, 70.0)


def limits(dice: np.random.Generator) -> tuple[JointLimit, ...]:
    """Draw limits, wide and narrow, fast and slow."""
    low, high = (
        -radians(80.0) * dice.uniform(0.02, 1.0, 9),
        radians(80.0) * dice.uniform(0.02, 1, 9),
    )
    speed = radians(1.0) * 10.0 ** dice.uniform(1.0, 3.2, 9)
    accel = radians(1.0) * 10.0 ** dice.uniform(2.0, 4.8, 9)
    rows = np.stack((low, high, speed, accel), axis=1).tolist()
    return tuple(JointLimit(*row) for row in rows)


class Watched:
    """A guard whose every command is judged."""

    def __init__(self, dice: np.random.Generator, params: GuardParams = GENTLE) -> None:
        self.dice = dice
        self.guard = Guard(params, limits(dice), GAZE_JOINTS)
        self.guard.reset(0.0, (0.0,) * 9)
        self.p, self.v, self.t_s = np.zeros(9), np.zeros(9), 0.0
        self.desired = np.zeros(9)

    def tick(self) -> None:
        before = np.array(self.guard.limits)
        self.t_s += DT_S
        joints = JointState(tuple(self.p), (0.0,) * 9, (self.t_s,) * 9, ())
        verdict = self.guard.check(tuple(self.desired), joints, 0.0, self.t_s)
        after = np.array(self.guard.limits)
        p = np.array(verdict.command_rad)
        v = (p - self.p) / DT_S
        speed, accel = (np.maximum(before[:, k], after[:, k]) for k in (2, 3))
        assert (np.abs(v) <= speed + 1e-6).all()
        assert (np.abs(v - self.v) <= accel * DT_S + 1e-6).all()
        # Who is outside its range never goes farther out than braking takes it.
        out = np.maximum(after[:, 0] - p, p - after[:, 1])
        was = np.maximum(after[:, 0] - self.p, self.p - after[:, 1])
        assert (out <= np.maximum(was, 0.0) + 1e-9).all()
        self.p, self.v = p, v

    def wander(self, ticks: int) -> None:
        for _ in range(ticks):
            if self.dice.random() < 0.1:
                self.desired = self.dice.uniform(-1.5, 1.5, 9)
            self.tick()


@pytest.mark.parametrize("seed", range(4))
def test_every_command_keeps_the_limits_in_force(seed: int) -> None:
    dice = np.random.default_rng(seed)
    watched = Watched(dice)
    for _ in range(60):
        watched.wander(int(dice.integers(2, 40)))
        boxes = (BOX,) if dice.random() < 0.3 else ()
        try:
            watched.guard.retune(GuardParams(soft_start_ms=50.0, collisions=boxes), limits(dice))
        except ValueError:  # no pose is left
            continue


@pytest.mark.parametrize("seed", range(4))
def test_new_limits_come_into_force_and_every_joint_gets_inside(seed: int) -> None:
    dice = np.random.default_rng(seed)
    watched = Watched(dice)
    watched.wander(200)
    wanted = limits(dice)
    watched.guard.retune(GENTLE, wanted)
    watched.wander(1000)
    assert watched.guard.limits == wanted
    low, high = np.array(wanted).T[:2]
    assert ((watched.p >= low - 1e-9) & (watched.p <= high + 1e-9)).all()


def test_angles_counted_otherwise_send_the_joint_to_the_same_place() -> None:
    watched = Watched(np.random.default_rng(0))
    watched.wander(100)
    hard = np.array(watched.guard.limits)[:, 3] * DT_S
    while not (fast := np.abs(watched.v) > 4.0 * hard).any():
        watched.wander(1)
    i, factor, offset = int(fast.argmax()), -0.5, 0.2
    before: NDArray[np.float64] = watched.p.copy()
    watched.guard.recount(i, factor, offset)
    watched.p[i], watched.v[i] = factor * watched.p[i] + offset, factor * watched.v[i]
    watched.tick()
    assert abs(watched.p[i] - (factor * before[i] + offset)) <= abs(watched.v[i]) * DT_S + 1e-9
    watched.wander(100)


def test_a_collision_that_leaves_no_pose_changes_nothing() -> None:
    watched = Watched(np.random.default_rng(0))
    before = watched.guard.limits
    all_of_it = CollisionParams("neck_pitch", -179.0, 179.0, "left_upper_lid", -179.0, 179.0)
    with pytest.raises(ValueError, match="leaves no pose"):
        watched.guard.retune(GuardParams(collisions=(all_of_it,)), limits(watched.dice))
    watched.wander(20)
    assert watched.guard.limits == before


def test_servos_that_keep_to_less_bound_what_is_in_force() -> None:
    first = tuple(JointLimit(-1.0, 1.0, 5.0, 50.0) for _ in range(9))
    guard = Guard(GENTLE, first, GAZE_JOINTS, lambda: first)
    guard.reset(0.0, (0.0,) * 9)
    wider = tuple(JointLimit(-1.5, 0.5, 9.0, 90.0) for _ in range(9))
    guard.retune(GENTLE, wider)
    joints = JointState((0.0,) * 9, (0.0,) * 9, (DT_S,) * 9, ())
    guard.check((0.0,) * 9, joints, 0.0, DT_S)
    assert guard.limits[0] == JointLimit(-1.0, 0.5, 5.0, 90.0)

"""A hundred thousand random wishes with random servos: nothing outside any limit leaves."""

from collections.abc import Callable
from math import inf, nan, radians
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from gaze_targets import joints_at
from guarded_desk import DT, EYE, NECK, guarding
from numpy.typing import NDArray

from gazerig.robot.model.guard_params import CollisionParams, GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointState
from gazerig.robot.safety.guard import Guard

Array = NDArray[np.float64]
Row = tuple[float, ...]
LENGTH = 25  # ticks of one sequence
WISHES = 6_000  # of each guard, of which there are 24
LID = JointLimit(radians(-30), radians(25), radians(1200), radians(60_000), 70.0, 3.5, 7.0)
SLOW = JointLimit(radians(-5), radians(170), radians(3), radians(10), 80.0, 9.5, 16.0)
RIGS = ((EYE,) * 4 + (LID,) * 2 + (NECK,) * 3, (SLOW, LID, NECK) * 3)
BOXES = (
    (),
    (CollisionParams(("neck_pitch", -30.0, -18.0), ("left_upper_lid", 10.0, 20.0)),),
    (
        CollisionParams(("neck_pitch", -4.0, 12.0), ("left_upper_lid", -10.0, 20.0)),
        CollisionParams(("right_upper_lid", -3.0, 50.0), ("neck_pitch", -60.0, -20.0)),
        CollisionParams(("neck_yaw", -3.0, 4.0), ("left_eye_pan", 10.0, 20.0)),
    ),
)
ODD = np.array([nan, inf, -inf, 1e300, -1e300, 1e-300, -0.0])


class Trial:
    """One guard and its results: begin is the start of a tick, after restarts."""

    def __init__(self, limits: tuple[JointLimit, ...], boxes: tuple[CollisionParams, ...]) -> None:
        self.limits = np.array(limits)
        self.boxes = boxes
        self.guard = Guard(GuardParams(collisions=boxes), limits, GAZE_JOINTS)
        self.low, self.high = self.limits[:, 0], self.limits[:, 1]
        self.begin_p: list[Row] = []
        self.begin_v: list[Row] = []
        self.dt_s: list[float] = []
        self.after: list[Row] = []
        self.t_s = 0.0

    def restart(self, angles: Array) -> None:
        self.guard.reset(self.t_s, tuple(angles.tolist()))
        self.p, self.v = tuple(np.clip(angles, self.low, self.high).tolist()), (0.0,) * 9

    def tick(self, desired: Row, joints: JointState, age_s: float, dt_s: float) -> None:
        self.t_s += dt_s
        verdict = self.guard.check(desired, joints, age_s, self.t_s)
        if True in joints.rearmed:
            again = np.array(joints.rearmed) & np.isfinite(joints.position_rad)
            clipped = np.clip(joints.position_rad, self.low, self.high)
            self.p = tuple(np.where(again, clipped, self.p).tolist())
            self.v = tuple(np.where(again, 0.0, self.v).tolist())
        self.begin_p.append(self.p)
        self.begin_v.append(self.v)
        self.dt_s.append(dt_s)
        self.v = tuple([(b - a) / dt_s for a, b in zip(self.p, verdict.command_rad, strict=True)])
        self.p = verdict.command_rad
        self.after.append(self.p)
        assert verdict.level == "torque_off" or not any(joints.fault)
        assert (verdict.level == "ok") == (not verdict.reasons)

    def judge(self) -> None:
        """Assert every limit on every command."""
        p0, v0, p1 = map(np.array, (self.begin_p, self.begin_v, self.after))
        dt_s = np.array(self.dt_s)[:, None]
        low, high, speed, accel = self.limits[:, :4].T
        v1 = (p1 - p0) / dt_s
        assert np.isfinite(p1).all()
        assert (p1 >= low).all() and (p1 <= high).all()
        assert (np.abs(v1) <= speed + 1e-6).all()
        assert (np.abs(v1 - v0) <= accel * dt_s + 4e-6).all()
        for box in self.boxes:
            self._judge_box(box, p0, v0, p1, v1)

    def _judge_box(self, box: CollisionParams, p0: Array, v0: Array, p1: Array, v1: Array) -> None:
        """Once a joint of the pair can stay out of its range, one always can, and does."""
        i, j = GAZE_JOINTS.index(box.first[0]), GAZE_JOINTS.index(box.second[0])
        first = (radians(box.first[1]), radians(box.first[2]))
        second = (radians(box.second[1]), radians(box.second[2]))
        margin = radians(1.0)

        def stays_out(k: int, span: tuple[float, float], p: Array, v: Array, off: float) -> Array:
            stop = p[:, k] + 0.5 * v[:, k] * np.abs(v[:, k]) / self.limits[k, 3]
            low = np.maximum(p[:, k], stop) <= span[0] - margin + off
            high = np.minimum(p[:, k], stop) >= span[1] + margin - off
            return np.where(low, -1, np.where(high, 1, 0))

        safe = (stays_out(i, first, p0, v0, 0.0) != 0) | (stays_out(j, second, p0, v0, 0.0) != 0)
        ways = [
            stays_out(k, span, p0, v0, 1e-6) * stays_out(k, span, p1, v1, 1e-6)
            for k, span in ((i, first), (j, second))
        ]
        # Outside on the same side before and after: the straight path misses the box.
        assert ((ways[0] > 0) | (ways[1] > 0))[safe].all()


def sequence(trial: Trial, rng: np.random.Generator) -> None:
    """Run one sequence: a mood of wishes, one of servos and one of time."""
    n, limits = LENGTH, trial.limits
    middle, reach = (trial.low + trial.high) / 2, trial.high - trial.low
    if rng.random() < 0.1:
        trial.restart(middle + reach * rng.uniform(-0.6, 0.6, 9))
    if rng.random() < 0.5:
        trial.guard._gentle = [False] * 9
    if rng.random() < 0.75:  # in peace, inside every limit
        sway = 0.001 * np.sin(np.arange(1, n + 1) / 8.0)[:, None] ** 3
        wishes = np.array(trial.p) + sway * np.sign(middle - trial.p)
    else:
        wishes = middle + reach * WISH_MOODS[rng.integers(len(WISH_MOODS))](rng, n)
    odd = rng.random((n, 9)) < rng.choice([0.0, 0.0, 0.05])
    wishes[odd] = rng.choice(ODD, int(odd.sum()))
    ticks = rng.uniform(0.001, 0.1, n) if rng.random() < 0.3 else np.full(n, rng.choice(TICKS))
    rare = rng.choice([0.0, 0.0, 0.0, 0.01, 0.2])
    off, faulty, again, old = rng.random((4, n, 9)) < rare
    stray = rng.random((n, 9)) < rng.choice([0.0, 0.0, 0.1, 1.0])
    strays = middle + reach * rng.normal(0.0, 0.5, (n, 9))
    strays[rng.random((n, 9)) < 0.02 * rare] = nan
    jam = rng.random(9) < rng.choice([0.0, 0.0, 0.3])
    jammed_at = trial.p
    load = np.where(rng.random((n, 9)) < rng.choice([0.0, 0.0, 0.9]), rng.uniform(-1, 1, 9), 0.1)
    heat = limits[:, 4] + np.where(rng.random(9) < rare, rng.uniform(-20, 2, 9), -30.0)
    volts = np.where(rng.random((n, 9)) < rare, rng.uniform(3, 17, (n, 9)), limits[:, 5] + 1.0)
    unseen = rng.random(n) < rare
    instead = stray | again | jam
    places = np.where(jam, jammed_at, strays)
    words = np.where(faulty, "overload", "")
    ages = np.where(old, 1.0, 0.0)
    rows = (wishes, instead, places, ages, ~off, words, load, np.tile(heat, (n, 1)), volts, again)
    for k, (desired, other, place, age, *reported, rearmed) in enumerate(
        zip(*[[tuple(row) for row in column.tolist()] for column in rows], strict=True)
    ):
        tick = float(ticks[k])
        t_s = trial.t_s + tick
        at = tuple([b if o else a for a, b, o in zip(trial.p, place, other, strict=True)])
        since = tuple([t_s - one for one in age])
        columns: Any = (at, (0.0,) * 9, since, (), *reported, rearmed)
        joints = JointState(*columns)
        trial.tick(desired, joints, inf if unseen[k] else 0.0, tick)


TICKS = (0.001, 0.004, 0.005, 0.005, 0.005, 0.02, 0.1)
WISH_MOODS: tuple[Callable[[np.random.Generator, int], Array], ...] = (
    lambda rng, n: rng.normal(0.0, 0.5, (n, 9)),  # shaking
    lambda rng, n: np.repeat(rng.uniform(-0.6, 0.6, (1, 9)), n, axis=0),  # a jump
    lambda rng, n: np.cumsum(rng.normal(0.0, 0.02, (n, 9)), axis=0),  # a walk
    lambda rng, n: np.linspace(rng.uniform(-1, 1, 9), rng.uniform(-1, 1, 9), n),  # a sweep
    lambda rng, n: np.where(rng.random((n, 9)) < 0.2, 0.5, -0.5) * rng.choice([1.0, 40.0]),
)


@pytest.mark.parametrize("seed", range(6))
def test_random_wishes_never_leave_the_limits(seed):
    rng = np.random.default_rng([2024, seed])
    for _ in range(4):
        trial = Trial(RIGS[seed % 2], BOXES[seed // 2])
        trial.restart(np.zeros(9))
        while 9 * len(trial.after) < WISHES:
            sequence(trial, rng)
        trial.judge()


# Limits changed at random in full flight: every command keeps the present ones, and new ones come


BOX = CollisionParams(("neck_pitch", -60.0, -30.0), ("left_upper_lid", 40.0, 70.0))


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

    def __init__(self, dice: np.random.Generator) -> None:
        self.dice = dice
        self.guard = guarding(limits=limits(dice), gentle=True)
        self.p, self.v, self.t_s = np.zeros(9), np.zeros(9), 0.0
        self.desired = np.zeros(9)

    def tick(self) -> None:
        before = np.array(self.guard.limits)
        self.t_s += DT
        joints = joints_at(self.p.tolist(), self.t_s)
        verdict = self.guard.check(tuple(self.desired), joints, 0.0, self.t_s)
        after = np.array(self.guard.limits)
        p = np.array(verdict.command_rad)
        v = (p - self.p) / DT
        speed, accel = (np.maximum(before[:, k], after[:, k]) for k in (2, 3))
        assert (np.abs(v) <= speed + 1e-6).all()
        assert (np.abs(v - self.v) <= accel * DT + 1e-6).all()
        # A joint outside its range moves no farther out than its braking distance.
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
def test_every_command_keeps_the_limits_in_force(seed):
    dice = np.random.default_rng(seed)
    watched = Watched(dice)
    for _ in range(60):
        watched.wander(int(dice.integers(2, 40)))
        boxes = (BOX,) if dice.random() < 0.3 else ()
        try:
            watched.guard.retune(GuardParams(collisions=boxes), limits(dice))
        except ValueError:  # no pose is left
            continue


@pytest.mark.parametrize("seed", range(4))
def test_new_limits_come_into_force_and_every_joint_gets_inside(seed):
    dice = np.random.default_rng(seed)
    watched = Watched(dice)
    watched.wander(200)
    own, wanted = watched.guard.limits, limits(dice)
    wider = watched.guard.retune(GuardParams(), wanted)
    watched.wander(1000)
    present = watched.guard.limits
    assert present == tuple(map(JointLimit.reduced_to, wanted, own))
    assert wider == [i for i in range(9) if present[i] != wanted[i]] != []
    low, high = np.array(present).T[:2]
    assert ((watched.p >= low - 1e-9) & (watched.p <= high + 1e-9)).all()


def test_a_collision_that_leaves_no_pose_changes_nothing():
    watched = Watched(np.random.default_rng(0))
    before = watched.guard.limits
    all_of_it = CollisionParams(("neck_pitch", -179.0, 179.0), ("left_upper_lid", -179.0, 179.0))
    with pytest.raises(ValueError, match="allows no pose"):
        watched.guard.retune(GuardParams(collisions=(all_of_it,)), limits(watched.dice))
    watched.wander(20)
    assert watched.guard.limits == before

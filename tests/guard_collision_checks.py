"""Checks of forbidden ranges: a broken guard does not pass them."""

from itertools import pairwise
from math import degrees, radians
from types import ModuleType

import numpy as np
import pytest
from desk import GAZE_JOINTS
from guard_bench import DT, HIGH, LID, LOW, PITCH, YAW, Bench

from gazerig.robot.model.guard_params import CollisionParams, GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointState


def collision(m: ModuleType) -> None:
    pair = CollisionParams(("neck_pitch", -20.0, -10.0), ("left_upper_lid", 10.0, 20.0))

    def desired(pitch: float, lid: float) -> tuple[float, ...]:
        angles = {PITCH: radians(pitch), LID: radians(lid)}
        return tuple(angles.get(k, 0.0) for k in range(9))

    for swap in (False, True):
        if swap:
            pair = CollisionParams(("left_upper_lid", 10.0, 20.0), ("neck_pitch", -20.0, -10.0))
        bench = Bench(m, collisions=(pair,))
        rng = np.random.default_rng(9)
        places = []
        for _ in range(80):
            target = desired(
                *rng.choice([-40.0, -21.5, -15.0, -8.5, 0.0, 8.5, 15.0, 21.5, 40.0], 2)
            )
            for _ in range(rng.integers(5, 70)):
                bench.tick(target)
                places.append(tuple(degrees(bench.path[-1][j]) for j in (PITCH, LID)))
        for (p, q), (r, s) in pairwise(places):
            # The margin of 1 deg counts as well: the walls are there.
            apart = min(p, r) > -9.001 or max(p, r) < -20.999
            apart = apart or min(q, s) > 20.999 or max(q, s) < 9.001
            assert apart, (p, q, r, s)
        # Each alone may go there, and each does.
        assert [p for p, _ in places if -20.0 < p < -10.0]
        assert [q for _, q in places if 10.0 < q < 20.0]


def collision_braking(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        ends = sorted((way * 10.0, way * 20.0))
        pair = CollisionParams(("left_upper_lid", 10.0, 20.0), ("neck_yaw", ends[0], ends[1]))
        for k in range(40, 54):  # the neck turns round too late not to enter its range
            bench = Bench(m, start_deg=-way * 30.0, collisions=(pair,))
            for tick in range(150):
                yaw, lid = (way * 40.0, 0.0) if tick < k else (way * 2.0, 15.0)
                bench.tick(tuple(radians({YAW: yaw, LID: lid}.get(j, 0.0)) for j in range(9)))
            assert bench.path[-1][LID] == pytest.approx(radians(15.0))


def collision_lag(m: ModuleType) -> None:
    pair = CollisionParams(("left_upper_lid", 10.0, 20.0), ("neck_yaw", -20.0, -10.0))
    for start_deg in (-15.0, 0.0):
        bench = Bench(m, collisions=(pair,))
        for _ in range(150):
            bench.tick(tuple(radians(start_deg) if k == YAW else 0.0 for k in range(9)))
        if start_deg == 0.0:  # the neck is the keeper, as the lid was last in
            for lid_deg in (15.0, 0.0):
                for _ in range(100):
                    bench.tick(tuple(radians(lid_deg) if k == LID else 0.0 for k in range(9)))
        for _ in range(25):  # the neck is measured inside all the while
            bench.tick(tuple(radians(15.0) if k == LID else 0.0 for k in range(9)), at=radians(-15))
            assert bench.path[-1][LID] <= radians(9.0) + 1e-9


def slow_joint(m: ModuleType) -> None:
    limit = JointLimit(LOW, HIGH, radians(20.0), radians(100.0))  # below the gentle ones
    pair = CollisionParams(("neck_pitch", -20.0, 5.0), ("left_upper_lid", -20.0, 15.0))
    guard = m.Guard(GuardParams(collisions=(pair,)), (limit,) * 9, GAZE_JOINTS)
    guard.reset(0.0, (0.0,) * 9)
    path, speed = [(0.0,) * 9], np.zeros(9)
    for k in range(1, 300):
        state = JointState(path[-1], (0.0,) * 9, (k * DT,) * 9, ())
        path.append(guard.check((0.5,) * 9, state, 0.0, k * DT).command_rad)
        before, speed = speed, (np.array(path[-1]) - np.array(path[-2])) / DT
        assert np.abs(speed).max() <= radians(20.0) + 1e-9
        assert np.abs(speed - before).max() <= radians(100.0) * DT + 1e-9


def collision_start(m: ModuleType) -> None:
    pair = CollisionParams(("neck_pitch", -20.0, 5.0), ("left_upper_lid", -20.0, 15.0))
    bench = Bench(m, collisions=(pair,))
    while bench.path[-1][PITCH] < radians(5.9):
        assert bench.t_s < 1.0
        bench.tick(0.3)
        assert abs(bench.speed[PITCH]) <= radians(60.0) + 1e-6
        assert bench.path[-1][LID] == 0.0 or bench.path[-1][PITCH] >= radians(5.9)

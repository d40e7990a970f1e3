"""Limits of motion, strain and stalls of single joints, step by step, computed by hand.

The joint reaches 1 rad to both sides, 2 rad/s and 8 rad/s^2. A step of 1/8 s changes its speed by
1 rad/s at most, from 1 rad/s it stops within 1/16 rad: all numbers are exact.
"""

from math import inf, radians
from typing import Any

import pytest
from gaze_targets import joints_at
from text_table import rows

from gazerig.robot.model.guard_params import CollisionParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.safety.collisions import Collisions
from gazerig.robot.safety.health import JointHealth, StallDetector
from gazerig.robot.safety.motion_limiter import (
    LateTicks,
    LimitChange,
    MotionLimiter,
)

LIMIT = JointLimit(-1.0, 1.0, 2.0, 8.0)
DT = 0.125


def moving(p: float = 0.0, v: float = 0.0, side: int = 1) -> MotionLimiter:
    """Return a limiter of one joint in motion, all of it mirrored if ``side`` is -1."""
    motion = MotionLimiter((LIMIT,))
    motion.command[0], motion.speed[0] = side * p, side * v
    return motion


def state(motion: MotionLimiter, side: int = 1) -> tuple[float, float, float]:
    return side * motion.command[0], side * motion.speed[0], side * motion.goal[0]


STEPS = """
# Steps of 1/8 s, and the angle, the speed and the goal after them. at: angle, speed and goal;
# seek: goal, highest speed, acceleration, speed of the goal, acceleration to regain speed.
# What keeps every limit is followed at once, and nothing else.
at:0:0 follow:0.125 | 0.125 1 0.125
at:0:0 follow:0.12500001 | 0 0 0
at:0:1.5 follow:0.25 | 0.25 2 0.25
at:0:1.5 follow:0.25000001 | 0 1.5 0
at:0:1.5 follow:0.0625 | 0.0625 0.5 0.0625
at:0:1.5 follow:0.06249999 | 0 1.5 0
at:0.25:1 follow:0.25 | 0.25 0 0.25
at:0.25:1 follow:0.24999999 | 0.25 1 0.25
at:0.8125:0.5 follow:0.9375 | 0.9375 1 0.9375
at:0.8126:0.5 follow:0.9376 | 0.8126 0.5 0.8126
at:1:0 follow:1 | 1 0 1
at:1:0 follow:0.875 | 0.875 -1 0.875
# Nor by a joint that still catches up with its goal.
at:0:1:0.125 follow:0.125 | 0.125 1 0.125
at:0:1:0.12500001 follow:0.125 | 0 1 0.12500001
at:0:1:-0.12500001 follow:0.125 | 0 1 -0.12500001
# Steps towards a goal: highest speed, acceleration, speed of the goal.
at:0:0 seek:0.9:9:4 | 0.0625 0.5 0.9  # as fast as soft acceleration allows
at:0:0 seek:0.9:9:99 | 0.125 1 0.9  # and the joint's own
at:0:0 seek:0.9:0.25:4 | 0.03125 0.25 0.9
at:-1:1.75 seek:0.9:9:8 | -0.75 2 0.9
at:0:2 seek:0.9:0.5:8 | 0.125 1 0.9  # too fast for the new speed: brakes to it
at:0:1.25 seek:0.9:0.5:8 | 0.0625 0.5 0.9
at:0:1 seek:0.1875:9:8 | 0.125 1 0.1875  # can just stop there
at:0:0.5 seek:0.09375:9:4 | 0.0625 0.5 0.09375
at:0.8125:1 seek:5:9:8 | 0.9375 1 1
at:0:1.5 seek:0.25:9:8:0.5 | 0.1875 1.5 0.25  # with a goal that moves itself
at:0:0.5 seek:0.0625:9:8:0.5 | 0.0625 0.5 0.0625
at:0.8125:1 seek:5:9:8:1 | 0.9375 1 1  # but not out of its range
at:0.9375:2 seek:5:9:8 | 1 0.5 1  # nor if it can no longer stop
at:0:1.5 seek:-0.9:9:4 | 0.0625 0.5 -0.9  # to turn round it brakes at full strength
at:0:1 seek:-0.9:9:4 | 0 0 -0.9
at:0:0.5 seek:-0.9:9:4 | -0.03125 -0.25 -0.9
at:0:0 seek:0:9:4 | 0 0 0
# Steps after a goal that moves: at its pace, unless it jumped.
at:0:0.5:0 chase:0.0625:2 | 0.0625 0.5 0.0625
at:0:0:0 chase:0.125:1 | 0.125 1 0.125
at:0:-1:0 chase:-0.1875:1 | -0.125 -1 -0.1875
at:0:0:0.5 chase:0.0625:2 | 0.0517766953 0.414213562 0.0625
at:0:1:0.1875 chase:0.3125:2 | 0.25 2 0.3125
at:0:0:0.9 chase:5:2 | 0.125 1 1
# A slow motion regains the speed that it lost in a short gap, and no more.
slow gap:0.03125 seek:9:2:0.5:0:1.5 | 0.2421875 0.9375 9
slow gap:0.03125 seek:9:2:0.5:0:1 | 0.234375 0.875 9
slow gap:0.03125 seek:9:2:0.5:0:99 | 0.25 1 9
wide at:0:1 gap:0.03125 seek:9:2:0.5:0:99 | 0.1015625 0.8125 9  # was not slow
slow gap:0.05 seek:9:2:0.5:0:99 | 0.25 1 9
slow gap:0.0625 seek:9:2:0.5:0:99 | 0.1953125 0.5625 9  # longer: as from rest
slow gap:0.03125 gap:0.03125 seek:9:2:0.5:0:99 | 0.25 1 9
slow gap:0.03125 gap:0.0625 seek:9:2:0.5:0:99 | 0.1640625 0.3125 9
slow gap:0.125 seek:9:2:0.5:0:99 | 0.1328125 0.0625 9
slow gap:0.25 seek:9:2:0.5:0:99 | 0.1328125 0.0625 9
slow gap:0.03125 | 0.125 0.75 0.125
wide at:0:1:0.5 gap:0.25 | 0 0 0
wide at:0:0 seek:9:1:0.5:0:8 | 0.0078125 0.0625 9  # at first there is none
wide at:0:.5 seek:9:.5:.5:0:1 gap:.03125 seek:2.5:2:.5:0:1 | 0.109375 0.375 2.5
# It is forgotten when it brakes, starts again, reaches the wanted speed or turns round.
slow gap:0.03125 brake:0.0625 | 0.140625 0.25 0.140625
slow gap:0.03125 brake:0.0625 seek:9:2:0.5:0:8 | 0.1796875 0.3125 9
slow gap:0.03125 forget gap:0.03125 seek:9:2:0.5:0:8 | 0.1953125 0.5625 9
slow gap:0.03125 restart:0.25 | 0.25 0 0.25
slow gap:0.03125 restart:0.25 seek:9:2:0.5:0:8 | 0.2578125 0.0625 9
slow gap:0.03125 seek:0.21875:1:4:0:8 seek:9:2:0.5:0:8 | 0.2578125 0.5625 9
slow gap:0.03125 seek:-9:1:0.5:0:8 | 0.123046875 -0.015625 -9
slow gap:0.03125 seek:-9:1:0.5:0:8 seek:9:2:0.5:0:8 | 0.130737305 0.0615234375 9
"""


def act(motion: MotionLimiter, side: int, action: str) -> None:
    name, *words = action.split(":")
    n = list(map(float, words))
    p = side * n[0] if n else 0.0
    match name:
        case "at":
            motion.command[0], motion.speed[0], motion.goal[0] = p, side * n[1], side * n[-1]
            if len(n) < 3:
                motion.goal[0] = p
        case "wide":
            motion.set_limit(0, LIMIT._replace(low_rad=-9.0, high_rad=9.0))
        case "slow":
            for one in ("wide", "at:0:1", "seek:9:1:0.5:0:8"):
                act(motion, side, one)
        case "follow":
            assert motion.follow(0, p, DT) is (motion.goal[0] == p)
        case "seek":
            motion.seek(0, p, DT, n[1], n[2], *(side * along for along in n[3:4]), *n[4:])
        case "chase":
            motion.chase(0, p, DT, n[1], 8.0)
        case "gap":
            motion.record_gap(n[0])
        case "brake":
            motion.brake(0, n[0])
        case "forget":
            motion.forget_gaps(0)
        case "restart":
            motion.restart(0, p)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("row", rows(STEPS))
def test_steps_keep_speed_acceleration_and_range(row, side):
    motion = MotionLimiter((LIMIT,))
    for action in row[:-3]:
        act(motion, side, action)
    found = motion.command[0], motion.speed[0], motion.goal[0]
    assert found == pytest.approx([side * value for value in row[-3:]], abs=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_walls_count_from_where_a_joint_can_stop(side):
    motion = moving(0.25, 1.0, side)
    ahead, behind = (motion.keeps_below, motion.keeps_above)[::side]
    walls = "0.3125 1 0\n 0.3124999995 1 0\n 0.312499998 0 0\n 0.25 0 1\n 0.2500000005 0 1"
    for wall, is_ahead, is_behind in rows(f"{walls}\n 0.250000002 0 0"):
        assert (ahead(0, side * wall), behind(0, side * wall)) == (is_ahead, is_behind)


def test_walls_only_narrow_a_range_and_go_with_its_reset():
    motion = moving(1.5)
    motion.wall_below(0, -0.5)
    motion.wall_below(0, -0.75)
    motion.wall_above(0, 0.5)
    motion.wall_above(0, 0.75)
    assert (motion.low, motion.high) == ([-0.5], [0.5])
    motion.reset_range(0)
    assert (motion.low, motion.high) == ([-1.0], [1.5])
    motion.command[0] = -1.5
    motion.set_limit(0, JointLimit(-0.5, 0.5, 2.0, 8.0))
    assert (motion.low, motion.high, motion.goal) == ([-1.5], [0.5], [-1.5])


KEEPS = """
0 1 1, 0 1.00000001 0, 0.4375 1 1, 0.4376 1 0, 0.6 -0.5 1, 0.6 0.5 0, 0.5 0 1, 0.6 0 1
"""


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("p", "v", "keeps"), rows(KEEPS.replace(",", "\n")))
def test_a_motion_keeps_another_limit_if_it_can_stop_inside(side, p, v, keeps):
    assert moving(p, v, side).keeps_limit(0, JointLimit(-0.5, 0.5, 1.0, 8.0)) == keeps


# Gaps, changed limits and late ticks


def test_new_limits_wait_until_the_joint_can_keep_them():
    motion = MotionLimiter((LIMIT, LIMIT))
    change = LimitChange(motion)
    narrow = JointLimit(-0.5, 0.5, 1.0, 8.0)
    motion.wall_above(0, 0.25)
    assert change.retune((LIMIT._replace(speed_rad_s=3.0), narrow)) == [0]
    assert change.waiting == {1} and motion.high == [1.0, 1.0]
    motion.command[1], motion.speed[1] = 0.25, 1.5
    change.step(False)
    assert motion.limits == [LIMIT, LIMIT]
    motion.speed[1] = 1.0
    change.step(True)  # walls are made for the present acceleration
    assert change.waiting == {1}
    change.step(False)
    assert (change.waiting, motion.limits[1], motion.high[1]) == (set(), narrow, 0.5)
    change.retune((LIMIT, LIMIT))
    assert change.waiting == {1} and motion.limits[1] == narrow
    change.reset()
    assert change.waiting == set() and motion.limits[1] == LIMIT


def test_a_joint_outside_its_new_range_is_so_until_it_is_inside():
    motion = MotionLimiter((LIMIT,))
    change = LimitChange(motion)
    change.retune((JointLimit(-0.5, 0.5, 1.0, 8.0),))
    for side in (1, -1):
        change.begin(0, side * 9.0)  # at rest, within the servo's own range
        change.step(True)
        assert state(motion) == (side, 0.0, side) and change.outside == {0}
        assert (motion.low[0], motion.high[0]) == ((-0.5, 1.0), (-1.0, 0.5))[side < 0]
        for out, outside in ((2e-9, {0}), (5e-10, set())):
            motion.command[0] = side * (0.5 + out)
            change.step(False)
            assert change.outside == outside
    assert motion.low[0] == pytest.approx(-0.5)


LATE = """
# Ticks in 1/128 s, at a rate of 64 Hz; time to move for and time without goals, in s
3                 0.0234375  0         # one and a half periods are in time
4                 0.015625   0.015625
4 4 4 4 4         0.015625   0.015625
4 4 4 4 4 4       0.03125    0         # five in a row are a slower pace
4 4 4 4 4 6       0.046875   0
4 4 4 4 4 8       0.03125    0.03125
4 4 4 4 4 2 4     0.015625   0.015625
8 8 8 8 8 8       0.0625     0
16 16 16 16 16 16 0.05       0.075     # too slow for a pace
"""


@pytest.mark.parametrize("row", rows(LATE))
def test_a_late_tick_is_one_gap(row):
    *ticks, moves_s, gap_s = row
    late = LateTicks(1 / 64)
    assert late.soft_until_s == -inf
    for k, tick in enumerate(ticks):
        late.soft_until_s = 0.0
        found = late.split(tick / 128, 10.0 + k, 0.5)
    assert found == pytest.approx((moves_s, gap_s), abs=1e-12)
    assert late.soft_until_s == (9.5 + len(ticks) if gap_s else 0.0)


# Strain and stalls


STRAIN = """
# Readings in turn, * ticks; share of the way from a stop to full speed; reason for it; for a stop.
t55                1    -        -
t60                0.5  hot      -
t64                0.1  hot      -
t65                0    hot      hot
t65_t63            0.2  hot      hot
t65_t62            0.3  hot      -
t63                0.2  hot      -
t90                0    hot      hot
t65_tnan           1    -        hot
v5                 1    -        -
v3.81              1    -        -
v3.65              0.5  voltage  -
v6.69              1    -        -
v6.85              0.5  voltage  -
v3.5*5             0    voltage  -
v3.4*3             0    voltage  -
v3.4*4             0    voltage  voltage
v7.1*4             0    voltage  voltage
v3.4*3_v5_v3.4     0    voltage  -
v3.4*9_v5*3        1    -        voltage
v3.4*9_v5*4        1    -        -
v3.4*4_v5*3_v3.4   0    voltage  voltage
v5*9_v3.4*3        0    voltage  -
v3.4*9_vnan        1    -        voltage
v3.65*9_v3.4       0    voltage  -
# Full load for 5.6 ticks (0.7 s) stops, for half of them slows down.
l1*2               1    -        -
l1*3               0.928571428571  overloaded  -
l-1*4              0.571428571429  overloaded  -
l1*6               0               overloaded  overloaded
l0.5*99            1    -        -
l0*9_l-1*3         0.928571428571  overloaded  -
l1*99_l0*8         0.952380952381  overloaded  overloaded
l1*99_l0*9         1    -        -
l1*4_l0*9          1    -        -
l1*4_lnan*9        0.571428571429  overloaded  -
l1*6_t70_v3.4*4    0    hot         overloaded
t70_v3.4*4         0    hot         hot
l1*6_v3.4*4        0    overloaded  overloaded
t60_v3.5           0    voltage     -
"""


@pytest.mark.parametrize(("readings", "share", "why", "held"), rows(STRAIN))
def test_strain_slows_a_joint_down_and_stops_it(readings, share, why, held):
    """Each word: temperature, voltage or load of the second joint, and for how many ticks."""
    limit = JointLimit(-1.0, 1.0, 2.0, 8.0, 70.0, 3.5, 7.0)
    health = JointHealth((limit, limit))
    usual = columns = {"temperature_c": 40.0, "voltage_v": 5.0, "load": 0.0}
    for word in readings.split("_"):
        name = next(name for name in usual if name[0] == word[0])
        value, _, times = word[1:].partition("*")
        columns = {**columns, name: float(value)}
        said: Any = {name: (usual[name], columns[name]) for name in usual}
        for _ in range(int(times or 1)):
            health.step(joints_at((0.0, 0.0), **said), DT)
    assert (health.why[1] or "-", health.held[1] or "-") == (why, held)
    assert health.share[1] == pytest.approx(0.2 + 0.8 * share)
    assert (health.share[0], health.why[0], health.held[0]) == (1.0, "", "")
    health.step(joints_at((0.0, 0.0), load=(0.0, 1.0)), DT)
    health.reset()
    assert (health.share, health.why, health.held) == ([1.0, 1.0], ["", ""], ["", ""])


STALLS = """
# case, time and angle of each measurement, number of the one at which it has stalled
stands          0 0, 0.1 0, 0.149 0, 0.15 0                 3
other_way       0 20, 0.149 20, 0.15 20                     2
moves_by_more   0 0, 0.1 0.51, 0.24 0.51, 0.25 0.51         3
moves_by_less   0 0, 0.1 0.49, 0.15 0.49                    2
moves_away      0 0, 0.1 -5, 0.15 -5                        2
other_by_more   0 20, 0.1 19.4, 0.2 19.4, 0.25 19.4         3
other_and_away  0 20, 0.1 21, 0.15 21                       2
was_near        0 0, 0.1 7.01, 0.15 0, 0.29 0, 0.3 0        4
changes_sides   0 0, 0.1 20, 0.2 20, 0.25 20                3
is_near         0 7.01, 1 12.99, 2 7.01                     -1
is_just_far     0 6.99, 0.2 6.99                            1
"""


@pytest.mark.parametrize("case", rows(STALLS))
def test_a_joint_has_stalled_if_it_stays_far_from_its_command(case):
    """The command is 10 deg."""
    steps, found = zip(case[1:-1:2], case[2:-1:2], strict=True), case[-1]
    stuck = StallDetector(2)
    for k, (at_s, deg) in enumerate(steps):
        stalled = stuck.has_stalled(1, radians(10.0), radians(deg), at_s, 50.0)
        assert stalled == (k == found)
        is_far = abs(deg - 10.0) > 3.0 and not stalled
        assert stuck.watched == [0, (1 if deg < 10.0 else -1) * is_far]
    if found >= 0:
        waits = [stuck.is_waiting(1, t_s) for t_s in (50.0, 50.99, 51.0, 50.5)]
        assert waits == [True, True, False, False] and not stuck.is_waiting(0, 50.0)
        stuck.has_stalled(1, 0.1, 0.0, 60.0, 60.0)
        stuck.has_stalled(1, 0.1, 0.0, 61.0, 61.0)
        stuck.forget(1)
        assert not stuck.is_waiting(1, 61.0) and stuck.watched == [0, 0]


# Walls in front of a box


BOX = """
# Both commands | desired | measured | held? | range of the first | of the second | exit of both
# The first joint is out and stays so; the second is free.
 0  0 | 20 20   |  0  0   | 0 0 | -90  9 | -90 90 | 0 0
40  0 | 20 20   | 40  0   | 0 0 |  31 90 | -90 90 | 0 0
# Both are out, and only the first wants in: they change roles.
 0  0 | 20  0   |  0  0   | 0 0 | -90 90 | -90  9 | 0 0
 0 40 | 20 40   |  0 40   | 0 0 | -90 90 |  31 90 | 0 0
 0  0 | nan 20  |  0  0   | 0 0 | -90  9 | -90 90 | 0 0
 0  0 | 20 nan  |  0  0   | 0 0 | -90 90 | -90  9 | 0 0
 0  0 | 20 inf  |  0  0   | 0 0 | -90 90 | -90  9 | 0 0
 0 40 | 20 31   |  0 40   | 0 0 | -90 90 |  31 90 | 0 0
 0  0 | 20  9   |  0  0   | 0 0 | -90 90 | -90  9 | 0 0
 0  0 | 95  0   |  0  0   | 0 0 | -90 90 | -90  9 | 0 0
 0  0 | 8.9 20  |  0  0   | 0 0 | -90  9 | -90 90 | 0 0
# Not while the second is still measured inside.
 0  0 | 20  0   |  0 10   | 0 0 | -90  9 | -90 90 | 0 0
 0  0 | 20  0   |  0 9.9  | 0 0 | -90 90 | -90  9 | 0 0
 0  0 | 20  0   |  0 30   | 0 0 | -90  9 | -90 90 | 0 0
# The first is measured inside: both keep out.
 0  0 |  0 20   | 20  0   | 0 0 | -90  9 | -90  9 | 0 0
40 40 | 40 20   | 20 40   | 0 0 |  31 90 |  31 90 | 0 0
# The first is in: the second keeps out.
20  0 | 20 20   | 20  0   | 0 0 | -90 90 | -90  9 | 0 0
20 40 | 20 20   | 20 40   | 0 0 | -90 90 |  31 90 | 0 0
# Both are in: one leaves by the nearest exit, the other is still.
12 20 |  0  0   | 12 20   | 0 0 | -90 90 | -90 90 | 9 0
20 29 |  0  0   | 20 29   | 0 0 | -90 90 | -90 90 | 0 31
12 20 |  0  0   | 12 20   | 1 0 | -90 90 | -90 90 | 0 9
12 20 |  0  0   | 12 20   | 1 1 | -90 90 | -90 90 | 0 0
"""


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("row", rows(BOX))
def test_one_joint_of_a_pair_has_a_wall(row, first):
    """Both must not be within 10..30 deg at once, with 1 deg of margin."""
    columns = list(zip(row[::2], row[1::2], strict=True))
    if first:  # the other joint, after the two have changed roles
        swapped = columns.pop(5), columns.pop(4)
        columns = [one[::-1] for one in columns]
        columns[4:4] = swapped
    begin, desired, measured, held, *ranges, exits = columns
    limit = JointLimit(radians(-90.0), radians(90.0), 2.0, 8.0)
    motion = MotionLimiter((limit, limit))
    box = Collisions((CollisionParams(("a", 10, 30), ("b", 10, 30)),), (limit, limit), ("a", "b"))
    assert box and not Collisions((), (limit, limit), ("a", "b"))
    motion.command = [0.0, 0.0]
    box.set_walls(motion, (0.3 * first, 0.0), (0.0, 0.0), (False, False))
    motion.command = [radians(deg) for deg in begin]
    box.exits[0], box.still = 0.0, {1}
    goals, places = (tuple(map(radians, one)) for one in (desired, measured))
    box.set_walls(motion, goals, places, list(map(bool, held)))
    for i, span in enumerate(ranges):
        assert (motion.low[i], motion.high[i]) == pytest.approx(tuple(map(radians, span)))
    assert box.exits == pytest.approx({i: radians(deg) for i, deg in enumerate(exits) if deg})
    inside = all(10 <= deg <= 30 for deg in begin)
    assert box.still == ({0, 1} - box.exits.keys() if inside else set())


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("farthest_first", [True, False])
def test_a_joint_leaves_all_its_boxes_on_one_side(side, farthest_first):
    """From -30 deg the only way out is up, past 0 deg; the end of the range is too near below."""

    def span(name: str, low: float, high: float) -> tuple[str, float, float]:
        low, high = sorted((side * low, side * high))
        return name, low, high

    low, high = sorted((side * radians(-35.5), side * radians(90.0)))
    limits = (JointLimit(low, high, 2.0, 8.0), JointLimit(-1.0, 1.0, 2.0, 8.0), LIMIT)
    pairs = [
        CollisionParams(span("a", -35, -1), ("b", 10, 30)),
        CollisionParams(span("a", -35, -21), ("c", 10, 30)),
    ]
    box = Collisions(pairs if farthest_first else pairs[::-1], limits, ("a", "b", "c"))
    motion = MotionLimiter(limits)
    motion.command = [side * radians(-30.0), radians(15.0), radians(15.0)]
    at = tuple(motion.command)
    box.set_walls(motion, at, at, (False, True, True))
    assert box.exits == pytest.approx({0: 0.0}, abs=1e-12) and box.still == {1, 2}
    box.set_walls(motion, at, at, (True, False, False))
    nine = radians(9.0)
    assert box.exits == pytest.approx({1: nine, 2: nine}) and box.still == {0}

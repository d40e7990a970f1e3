"""The guard broken on purpose, one check at a time: each time something here must notice.

Every mutation replaces one piece of the guard's source, which has to be there exactly once,
and names the check that notices. The same checks pass on the guard as it is.
"""

import sys
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from math import degrees, inf, nan, radians
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS

from gazerig.robot.model.forbidden_range import CollisionParams
from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JointState

ROOM = Path(__file__).parents[1] / "robot" / "safety"
PARTS = ("motion_limiter", "stall_detector", "health", "collisions", "late_ticks", "guard")
DT = 0.005
YAW, PITCH, LID = 6, 7, 4
JOINT = YAW
TOP, ACCEL = radians(200), radians(1_500)
LOW, HIGH = radians(-60), radians(50)


@cache
def _source(name: str) -> tuple[str, CodeType]:
    text = (ROOM / f"{name}.py").read_text(encoding="utf-8")
    return text, compile(text, f"{name}.py", "exec")


def built(part: str = "", old: str = "", new: str = "") -> ModuleType:
    """Load the guard's files from source, one of them changed, beside the real ones."""
    real = {name: sys.modules.get(f"gazerig.robot.safety.{name}") for name in PARTS}
    try:
        for name in PARTS:
            source, code = _source(name)
            if name == part:
                assert source.count(old) == 1, f"{old!r} stands {source.count(old)} times"
                code = compile(source.replace(old, new), f"{name}.py", "exec")
            module = ModuleType(f"gazerig.robot.safety.{name}")
            sys.modules[f"gazerig.robot.safety.{name}"] = module
            exec(code, module.__dict__)
        return module
    finally:
        for name, module_before in real.items():
            if module_before is not None:
                sys.modules[f"gazerig.robot.safety.{name}"] = module_before
            else:
                del sys.modules[f"gazerig.robot.safety.{name}"]


class Bench:
    """One guard and joints that do as they are told; every command is checked on its way."""

    def __init__(self, m: ModuleType, start_deg: float = 0.0, gentle: bool = False, **params: Any):
        limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
        self.guard = m.Guard(GuardParams(**params), (limit,) * 9, GAZE_JOINTS)
        self.guard.reset(0.0, (radians(start_deg),) * 9)
        if not gentle:
            self.guard._gentle = [False] * 9
        self.t_s = 0.0
        self.path = [(radians(start_deg),) * 9]
        self.speed: tuple[float, ...] = (0.0,) * 9
        self.why = ""
        self.level = ""

    def tick(self, desired: float | tuple[float, ...], age_s: float = 0.0, **said: Any) -> float:
        """One tick; said: a column for JOINT, or ``at`` and ``old_s`` for where it is."""
        self.t_s += DT
        at, old_s = said.pop("at", None), said.pop("old_s", 0.0)
        position = tuple(
            at if k == JOINT and at is not None else p for k, p in enumerate(self.path[-1])
        )
        ages = tuple(self.t_s - (old_s if k == JOINT else 0.0) for k in range(9))
        usual = {"torque": True, "fault": "", "rearmed": False, "load": 0.0, "measured": True}
        usual |= {"temperature_c": 40.0, "voltage_v": 5.0}
        columns: dict[str, Any] = {
            name: tuple(one if k == JOINT else usual[name] for k in range(9))
            for name, one in said.items()
        }
        state = JointState(position, (0.0,) * 9, ages, ())._replace(**columns)
        wishes = (desired,) * 9 if isinstance(desired, float) else desired
        verdict = self.guard.check(wishes, state, age_s, self.t_s)
        before: tuple[float, ...] = self.path[-1]
        if said.get("rearmed"):
            assert at is not None
            before = tuple(at if k == JOINT else p for k, p in enumerate(before))
            self.speed = tuple(0.0 if k == JOINT else v for k, v in enumerate(self.speed))
        self.path.append(verdict.command_rad)
        self._within(before)
        self.why, self.level = verdict.applied(GAZE_JOINTS[JOINT]).reason, verdict.level
        return verdict.command_rad[JOINT]

    def _within(self, before: tuple[float, ...]) -> None:
        after = self.path[-1]
        speed = tuple((b - a) / DT for a, b in zip(before, after, strict=True))
        for p, v, v_before in zip(after, speed, self.speed, strict=True):
            assert LOW <= p <= HIGH, f"position {p}"
            assert abs(v) <= TOP + 1e-6, f"speed {v}"
            assert abs(v - v_before) <= ACCEL * DT + 1e-6, f"acceleration {(v - v_before) / DT}"
        self.speed = speed


def range_and_braking(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        for pace_deg in (0.1, 0.4, 0.9):
            bench = Bench(m)
            for k in range(int(65.0 / pace_deg)):
                bench.tick(way * radians(k * pace_deg))
            assert bench.why == "out of range"
        bench = Bench(m)
        for _ in range(200):
            bench.tick(way * 3.0)


def speed(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        bench = Bench(m)
        desired = 0.0
        for k in range(36):
            desired += way * DT * min(k * 0.9 * ACCEL * DT, 1.02 * TOP)
            bench.tick(desired)
            assert bench.why in ("", "too fast")
        bench = Bench(m)
        for k in range(70):
            bench.tick(way * (0.9 if k > 10 else 0.0))


def acceleration(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        for share in (0.9, 0.99, 1.01, 1.1, 3.0):
            bench = Bench(m)
            bench.tick(way * share * ACCEL * DT * DT)
            assert bench.why == ("too hard" if share > 1.0 else "")
        bench = Bench(m)
        for k in range(120):
            bench.tick(way * (0.3 if k % 40 < 20 else -0.3))


def easily(m: ModuleType) -> None:
    """Slow joints: stopped at once from full speed, and creeping beyond their ends."""
    for way in (1.0, -1.0):
        bench = Bench(m)
        for k in range(40):
            bench.tick(way * 0.45 * ACCEL * (DT * min(k, 20)) ** 2)
        stopped = bench.path[-1][JOINT]
        for _ in range(40):
            bench.tick(stopped)
        bench = Bench(m, start_deg=degrees(HIGH if way > 0.0 else LOW) - way)
        creep = bench.path[-1][JOINT]
        for _ in range(100):
            creep += way * 0.4 * ACCEL * DT * DT
            bench.tick(creep)
        bench = Bench(m)  # in the first tick of all as in any other
        bench.tick(way * 1.3 * ACCEL * DT * DT)


def no_overshoot(m: ModuleType) -> None:
    for k in range(2, 60, 4):
        bench = Bench(m)
        jump = 0.01 * k
        assert max(bench.tick(jump) for _ in range(140)) <= jump + 1.01 * ACCEL * DT * DT
        assert bench.path[-1][JOINT] == pytest.approx(jump, abs=1e-9) and bench.why == ""


def stopped_loop(m: ModuleType) -> None:
    bench = Bench(m)
    state = JointState((0.0,) * 9, (0.0,) * 9, (10.0,) * 9, ())
    assert bench.guard.check((0.8,) * 9, state, 0.0, 10.0).command_rad[0] <= 0.1 * TOP + 1e-9
    for t_s in (10.0, 9.0, nan, inf):
        verdict = bench.guard.check((0.8,) * 9, state, 0.0, t_s)
        assert verdict.reasons == ("all: time stands still",) and verdict.level == "hold"


def late(m: ModuleType) -> None:
    """A joint at full speed, ticks that do not come: it goes on from its goal, softly."""
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    soft = radians(500.0)
    params = GuardParams(late_ms=50.0, late_accel_deg_s2=500.0)
    for missed in (2, 10, 400):
        guard = m.Guard(params, (limit,) * 9, GAZE_JOINTS, period_s=DT)
        guard.reset(0.0, (LOW,) * 9)
        guard._gentle = [False] * 9
        t_s, before, speed = 0.0, LOW, 0.0
        for k in range(16):
            t_s += DT if k != 8 else missed * DT
            joints = JointState((before,) * 9, (0.0,) * 9, (t_s,) * 9, ())
            now = guard.check((HIGH,) * 9, joints, 0.0, t_s).command_rad[0]
            if k >= 8:
                braked = max(0.0, speed - ACCEL * (missed - 1) * DT) if k == 8 else speed
                assert (now - before) / DT <= braked + soft * DT + 1e-9
            before, speed = now, (now - before) / DT


def late_while_gentle(m: ModuleType) -> None:
    """Every third tick misses two slots: a slow joint regains its speed, and no more than that."""
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    params = GuardParams(soft_start_speed_deg_s=20.0, soft_start_accel_deg_s2=50.0)
    for missed in (2, 60):
        guard = m.Guard(params, (limit,) * 9, GAZE_JOINTS, period_s=DT)
        guard.reset(0.0, (LOW,) * 9)
        t_s, before, fastest, last = 0.0, LOW, 0.0, 0.0
        for k in range(1, 400):
            gap = missed if k % 3 == 0 else 0
            t_s += (1 + gap) * DT
            joints = JointState((before,) * 9, (0.0,) * 9, (t_s,) * 9, ())
            now = guard.check((HIGH,) * 9, joints, 0.0, t_s).command_rad[0]
            speed, before = (now - before) / DT, now
            assert speed <= min(radians(20.0), fastest + radians(50.0) * DT) + 1e-9
            braked = max(0.0, last - ACCEL * gap * DT)
            assert abs(speed - braked) <= ACCEL * DT + 1e-9
            if gap > 50:  # longer than that it begins as from rest
                assert speed <= braked + radians(50.0) * DT + 1e-9
            fastest, last = max(fastest, speed), speed
        assert (now > LOW + 0.05) == (missed == 2)


def slow_host(m: ModuleType) -> None:
    """A loop that always takes two slots is a slower loop, and joints come to their speed."""
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    guard = m.Guard(GuardParams(), (limit,) * 9, GAZE_JOINTS, period_s=DT)
    guard.reset(0.0, (LOW,) * 9)
    guard._gentle = [False] * 9
    before = LOW
    for k in range(1, 25):
        joints = JointState((before,) * 9, (0.0,) * 9, (2 * k * DT,) * 9, ())
        now = guard.check((HIGH,) * 9, joints, 0.0, 2 * k * DT).command_rad[0]
        speed, before = (now - before) / (2 * DT), now
    assert speed > 0.8 * TOP


def not_finite(m: ModuleType) -> None:
    for bad in (nan, inf, -inf):
        bench = Bench(m)
        assert bench.tick(bad) == 0.0
        assert (bench.why, bench.level) == ("not finite", "hold")


def stale_joints(m: ModuleType) -> None:
    for desired in (0.0001, 0.5):
        for old_s, held in ((0.149, False), (0.151, True), (nan, True)):
            bench = Bench(m)
            assert (bench.tick(desired, old_s=old_s) == 0.0) == held
            assert (bench.why == "stale joints") == held
    assert Bench(m).tick(0.0001, at=nan) == 0.0


def stale_picture(m: ModuleType) -> None:
    for desired in (0.0001, 0.5):
        for age_s, held in ((1.499, False), (1.501, True), (inf, True), (nan, True)):
            bench = Bench(m)
            assert (bench.tick(desired, age_s) == 0.0) == held
            assert (bench.why == "stale frame") == held
            assert bench.path[-1][0] > 0.0


def hot(m: ModuleType) -> None:
    for celsius, share in ((54.0, 1.0), (60.0, 0.6), (64.0, 0.28), (65.0, 0.0)):
        bench = Bench(m)
        fastest = 0.0
        for _ in range(60):
            bench.tick(0.8, temperature_c=celsius)
            fastest = max(fastest, bench.speed[JOINT])
            assert bench.speed[0] == 0.0 or bench.why in ("", "hot", "too fast", "too hard")
        assert fastest == pytest.approx(share * TOP, rel=0.02)
        assert (bench.level == "hold") == (share == 0.0)
    bench = Bench(m)
    for k in range(80):  # a desired inside the joint's limits and outside what heat leaves
        bench.tick(0.25 * ACCEL * DT * DT * min(k, 40) ** 2 / 2, temperature_c=64.0)
        assert bench.speed[JOINT] <= 0.28 * TOP + 1e-9
    bench = Bench(m)
    reasons = []
    for celsius in (65.0, 64.0, 64.0, 62.0):
        bench.tick(0.8, temperature_c=celsius)
        reasons.append(bench.why)
    assert reasons == ["hot", "hot", "hot", "starting slowly"]


def overloaded(m: ModuleType) -> None:
    slow_s = held_s = None
    bench = Bench(m)
    while held_s is None:
        assert bench.t_s < 1.0
        at = bench.path[-1][JOINT] - radians(2.9)
        bench.tick(0.2 * bench.t_s, at=at, load=-1.0)
        if slow_s is None and bench.guard._health.share[JOINT] < 1.0:
            slow_s = bench.t_s
        if bench.level == "hold":
            held_s, where = bench.t_s, at
    assert bench.why == "overloaded"
    assert slow_s == pytest.approx(0.35, abs=0.02) and held_s == pytest.approx(0.7, abs=0.02)
    for _ in range(50):
        bench.tick(0.5, at=where, load=0.9)
    assert bench.path[-1][JOINT] == pytest.approx(where, abs=1e-6)
    bench = Bench(m)
    for _ in range(600):
        bench.tick(0.0, load=0.49)
    assert bench.level == "ok"


def voltage(m: ModuleType) -> None:
    for volts, share in ((3.9, 1.0), (3.65, 0.6), (6.85, 0.6), (3.4, 0.0), (7.1, 0.0)):
        bench = Bench(m)
        for k in range(140):
            bench.tick(0.8 if k > 5 else 0.0, voltage_v=volts)
            assert bench.speed[JOINT] <= max(share, 0.2) * TOP + 1e-9
            assert (bench.level == "hold") == (share == 0.0 and k >= 99)


def not_moving(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        bench = Bench(m)
        while bench.why != "not moving":
            assert bench.t_s < 0.3
            bench.tick(way * 0.4, at=0.0)
        for _ in range(100):
            bench.tick(way * 0.4, at=0.0)
        assert bench.level == "hold" and abs(bench.path[-1][JOINT]) < 1e-6
        for _ in range(600):  # tries again, weakly and slowly
            bench.tick(way * 0.4, at=0.0)
            assert abs(bench.path[-1][JOINT]) <= radians(4.6)
            assert abs(bench.speed[JOINT]) <= radians(60.0) + 1e-6 or bench.level == "hold"
    bench = Bench(m)
    for k in range(100):  # creeps towards its command
        bench.tick(0.5, at=bench.path[-1][JOINT] - radians(6.0 if k > 10 else 0.0))
        assert bench.why != "not moving" or k > 60
    bench = Bench(m)
    for k in range(100):  # dragged away
        bench.tick(0.0, at=radians(-4.0 - 0.1 * k))
    assert bench.why == "not moving"
    bench = Bench(m)
    for k in range(400):  # now far, now near, never far for long
        bench.tick(0.0, at=radians(4.0) if k % 20 < 15 else 0.0)
        assert bench.why == ""


def reckoned(m: ModuleType) -> None:
    bench = Bench(m)
    for _ in range(200):  # a servo that tells nothing is never found not moving
        bench.tick(0.4, at=0.0, measured=False)
        assert bench.why != "not moving"


def torque_off(m: ModuleType) -> None:
    for desired, at in ((0.0001, -0.2), (0.5, -0.2), (0.0001, -0.02)):
        bench = Bench(m)
        for _ in range(80):
            bench.tick(desired, at=at, torque=False)
            assert (bench.level, bench.why) == ("hold", "torque off")
        assert bench.path[-1][JOINT] == pytest.approx(at)
        bench.tick(0.5, at=at, torque=True)
        assert bench.why == "starting slowly"


def limp(m: ModuleType) -> None:
    for torque in (True, False):
        for desired in (0.0, 0.5, nan):
            bench = Bench(m)
            bench.tick(desired, fault="overload", torque=torque)
            assert (bench.level, bench.why) == ("torque_off", "overload")
    bench = Bench(m)
    for _ in range(60):
        bench.tick(0.8, fault="input voltage", torque=True)
        assert bench.speed[JOINT] <= radians(60.0) + 1e-6
    assert bench.path[-1][JOINT] > 0.05
    assert Bench(m).tick(0.8, fault="encoder", torque=True) == 0.0


def rearmed(m: ModuleType) -> None:
    bench = Bench(m)
    for _ in range(40):
        bench.tick(0.5)
    bench.tick(0.5, at=-0.3, rearmed=True)
    assert bench.why == "starting slowly"
    for _ in range(20):
        bench.tick(0.5)
        assert abs(bench.speed[JOINT]) <= radians(300.0) * 22 * DT


def gentle(m: ModuleType) -> None:
    bench = Bench(m, gentle=True)
    fastest, before = 0.0, 0.0
    for _ in range(190):
        bench.tick(0.8)
        assert bench.speed[JOINT] - before <= radians(300.0) * DT + 1e-9
        before = bench.speed[JOINT]
        fastest = max(fastest, before)
        assert bench.why == "starting slowly"
    assert fastest == pytest.approx(radians(60.0))
    bench, before = Bench(m, gentle=True), 0.0
    for k in range(60):  # a desired that a joint could keep up with
        bench.tick(0.25 * ACCEL * (k * DT) ** 2)
        assert bench.speed[JOINT] - before <= radians(300.0) * DT + 1e-9
        before = bench.speed[JOINT]


def slower_in_flight(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        bench = Bench(m)
        for k in range(80):
            bench.tick(way * 0.8, temperature_c=40.0 if k < 25 else 64.5)


def collision(m: ModuleType) -> None:
    pair = CollisionParams("neck_pitch", -20.0, -10.0, "left_upper_lid", 10.0, 20.0)

    def desired(pitch: float, lid: float) -> tuple[float, ...]:
        angles = {PITCH: radians(pitch), LID: radians(lid)}
        return tuple(angles.get(k, 0.0) for k in range(9))

    for swap in (False, True):
        if swap:
            pair = CollisionParams("left_upper_lid", 10.0, 20.0, "neck_pitch", -20.0, -10.0)
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
            # The margin of 1 deg counts as well: there the walls stand.
            apart = min(p, r) > -9.001 or max(p, r) < -20.999
            apart = apart or min(q, s) > 20.999 or max(q, s) < 9.001
            assert apart, (p, q, r, s)
        # Each alone may go there, and each does.
        assert [p for p, _ in places if -20.0 < p < -10.0]
        assert [q for _, q in places if 10.0 < q < 20.0]


def collision_braking(m: ModuleType) -> None:
    for way in (1.0, -1.0):
        ends = sorted((way * 10.0, way * 20.0))
        pair = CollisionParams("left_upper_lid", 10.0, 20.0, "neck_yaw", *ends)
        for k in range(40, 54):  # the neck turns round too late not to enter its range
            bench = Bench(m, start_deg=-way * 30.0, collisions=(pair,))
            for tick in range(150):
                yaw, lid = (way * 40.0, 0.0) if tick < k else (way * 2.0, 15.0)
                bench.tick(tuple(radians({YAW: yaw, LID: lid}.get(j, 0.0)) for j in range(9)))
            assert bench.path[-1][LID] == pytest.approx(radians(15.0))


def collision_lag(m: ModuleType) -> None:
    pair = CollisionParams("left_upper_lid", 10.0, 20.0, "neck_yaw", -20.0, -10.0)
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
    pair = CollisionParams("neck_pitch", -20.0, 5.0, "left_upper_lid", -20.0, 15.0)
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
    pair = CollisionParams("neck_pitch", -20.0, 5.0, "left_upper_lid", -20.0, 15.0)
    bench = Bench(m, collisions=(pair,))
    while bench.path[-1][PITCH] < radians(5.9):
        assert bench.t_s < 1.0
        bench.tick(0.3)
        assert abs(bench.speed[PITCH]) <= radians(60.0) + 1e-6
        assert bench.path[-1][LID] == 0.0 or bench.path[-1][PITCH] >= radians(5.9)


CHECKS: tuple[Callable[[ModuleType], None], ...] = (
    range_and_braking,
    speed,
    acceleration,
    easily,
    no_overshoot,
    stopped_loop,
    late,
    late_while_gentle,
    slow_host,
    not_finite,
    stale_joints,
    stale_picture,
    hot,
    overloaded,
    voltage,
    not_moving,
    reckoned,
    torque_off,
    limp,
    rearmed,
    gentle,
    slower_in_flight,
    collision,
    collision_braking,
    collision_lag,
    collision_start,
    slow_joint,
)

MOTION, STUCK, HEALTH, COLLISIONS, LATE, GUARD = PARTS
Mutation = tuple[str, str, str, Callable[[ModuleType], None]]
MUTATIONS: tuple[Mutation, ...] = (
    # position, and the way to brake before its end
    (
        MOTION,
        "desired + brake > self.high[i]",
        "desired + brake > self.high[i] + 0.1",
        range_and_braking,
    ),
    (
        MOTION,
        "desired - brake < self.low[i]",
        "desired - brake < self.low[i] - 0.1",
        range_and_braking,
    ),
    (MOTION, "brake = 0.5 * wanted", "brake = 0.3 * wanted", range_and_braking),
    (
        MOTION,
        "up = min(top, reachable_speed(high - p, accel, dt_s))",
        "up = top",
        range_and_braking,
    ),
    (
        MOTION,
        "down = -min(top, reachable_speed(p - low, accel, dt_s))",
        "down = -top",
        range_and_braking,
    ),
    (MOTION, "2.0 * accel * max(", "2.2 * accel * max(", range_and_braking),
    (GUARD, "if abs(desired - target) > _ROUNDING_RAD:", "if False:", range_and_braking),
    # speed
    (MOTION, "-top <= wanted <= top and", "wanted <= top and", speed),
    (MOTION, "-top <= wanted <= top and", "-top <= wanted and", speed),
    (MOTION, "up = min(top, reach", "up = min(2.0 * top, reach", speed),
    (MOTION, "down = -min(top, reach", "down = -min(2.0 * top, reach", speed),
    # acceleration
    (MOTION, "v - step <= wanted <= v + step", "v - step <= wanted", acceleration),
    (MOTION, "v - step <= wanted <= v + step", "wanted <= v + step", acceleration),
    (MOTION, "step, top = accel * dt_s,", "step, top = 1.2 * accel * dt_s,", acceleration),
    (MOTION, "most if wanted > most else", "1.1 * most if wanted > most else", acceleration),
    (MOTION, "least if wanted < least else", "1.1 * least if wanted < least else", acceleration),
    (MOTION, "return v + soft * dt_s", "return v + 1.1 * soft * dt_s", gentle),
    (MOTION, "chosen = max(up, v - accel * dt_s)", "chosen = up", slower_in_flight),
    (MOTION, "chosen = min(down, v + accel * dt_s)", "chosen = down", slower_in_flight),
    # slow joints far from their ends, which are checked in one go
    (MOTION, "0.49 * limit.accel_rad_s2", "1.9 * limit.accel_rad_s2", acceleration),
    (GUARD, "-easy <= v <= easy and ", "", easily),
    (GUARD, "-easy <= wanted <= easy and ", "", acceleration),
    (MOTION, "self.low[i] + room", "self.low[i] - 0.1", easily),
    (MOTION, "self.high[i] - room", "self.high[i] + 0.1", easily),
    (GUARD, "if not motion.easy_s <= dt_s <= 2.0 * motion.easy_s:", "if False:", easily),
    (MOTION, "self.easy_s = 0.9 * dt_s", "self.easy_s = 3.0 * dt_s", easily),
    # catching up
    (MOTION, "-step * dt_s <= self.goal[i] - p <= step * dt_s", "True", no_overshoot),
    (
        MOTION,
        "closing = reachable_speed(abs(gap), soft, dt_s)",
        "closing = abs(gap) / dt_s",
        no_overshoot,
    ),
    # time
    (LATE, "return pace_s, since_s", "return since_s, since_s", stopped_loop),
    (LATE, "return pace_s, since_s", "return since_s, since_s", late),
    (LATE, "        recent_s.append(since_s)\n        if", "        if", slow_host),
    (LATE, "self.soft_until_s = t_s + soft_s", "pass", late),
    (GUARD, "            self._motion.left_alone(missed_s)", "            pass", late),
    (GUARD, "soft = min(soft, self._late_accel)", "pass", late),
    (MOTION, "- limit.accel_rad_s2 * for_s", "", late),
    (MOTION, "min(lost, v + regain * dt_s)", "v", late_while_gentle),
    (MOTION, "min(lost, v + regain * dt_s)", "v + regain * dt_s", late_while_gentle),
    (MOTION, "min(lost, v + regain * dt_s)", "lost", late_while_gentle),
    (MOTION, "short = for_s <= SHORT_GAP_S", "short = True", late_while_gentle),
    (GUARD, "since_s > 0.0 and isfinite(since_s)", "isfinite(since_s)", stopped_loop),
    (GUARD, "since_s > 0.0 and isfinite(since_s)", "since_s > 0.0", stopped_loop),
    # numbers and ages
    (GUARD, "if not isfinite(desired):", "if False:", not_finite),
    (GUARD, "near and at_s >= stale_s and", "near and", stale_joints),
    (GUARD, "        if not fresh:", "        if False:", stale_joints),
    (GUARD, "fresh = fresh and isfinite(position)", "pass", stale_joints),
    (GUARD, "(no_frame and self._neck[i])\n            or", "", stale_picture),
    (GUARD, "self._all_well(joints) and not no_frame", "self._all_well(joints)", stale_picture),
    (GUARD, '_Hold("stale frame") if unseen else None', "None", stale_picture),
    (GUARD, "no_frame = not frame_age_s <=", "no_frame = frame_age_s >", stale_picture),
    # heat
    (HEALTH, "self._hot[i] = celsius >= (", "self._hot[i] = celsius >= 99.0 + (", hot),
    (HEALTH, "hot - _COOLER_C if", "hot if", hot),
    (HEALTH, "(hot - celsius) / (hot - warm)", "1.0", hot),
    (HEALTH, '"hot" if self._hot[i] else', "", hot),
    (GUARD, '_Hold(strain, again="slowly") if strain else None', "None", hot),
    (GUARD, "top, soft = share * limit.speed_rad_s,", "top, soft = limit.speed_rad_s,", hot),
    (GUARD, "or self._health.share[i] < 1.0", "", hot),
    (GUARD, "not self._health.fine", "False", hot),
    # load
    (HEALTH, "filled >= (0.5 if self._overloaded[i] else 1.0)", "False", overloaded),
    (HEALTH, "2.0 - 2.0 * filled", "1.0", overloaded),
    (HEALTH, "gained = (load * load -", "gained = (load -", overloaded),
    (HEALTH, "and min(load) >= -lasting)", ")", overloaded),
    (GUARD, 'if strain == "overloaded":', "if False:", overloaded),
    # voltage
    (HEALTH, "volts - self._limits[i].lowest_v", "9.9", voltage),
    (HEALTH, "self._limits[i].highest_v - volts", "9.9", voltage),
    (HEALTH, "outside_s >= self._outside_full_s and", "False and", voltage),
    (HEALTH, "max(room / self._params.voltage_margin_v, 0.0)", "1.0", voltage),
    # jams
    (STUCK, "if at_s - self._since_s[i] < self._stuck_s:", "if True:", not_moving),
    (STUCK, "-self.far_rad <= lead <= self.far_rad", "-self.far_rad <= lead", not_moving),
    (STUCK, "-self.far_rad <= lead <= self.far_rad", "lead <= self.far_rad", not_moving),
    (STUCK, "* side > self._moved_rad", "* side > 9.9", not_moving),
    (
        STUCK,
        "(position - self._anchor_rad[i]) * side >",
        "abs(position - self._anchor_rad[i]) >",
        not_moving,
    ),
    (STUCK, "self._until_s[i] = t_s + self._retry_s", "self._until_s[i] = t_s", not_moving),
    (GUARD, "not watched", "True", not_moving),
    (GUARD, "near = -far <= p - position <= far and", "near =", not_moving),
    (GUARD, "if joints.measured and not joints.measured[i]:", "if False:", reckoned),
    (GUARD, "self._retreat[i] = back = position", "pass", not_moving),
    (GUARD, "if self._retrying[i]:\n", "if False:\n", not_moving),
    # torque and faults
    (GUARD, "        if not powered:", "        if False:", torque_off),
    (GUARD, "or not all(joints.torque)", "", torque_off),
    (GUARD, "position if isfinite(position) else None, again", "None, again", torque_off),
    (GUARD, "return (3, fault) if fault else (rank, reason)", "return (rank, reason)", limp),
    (GUARD, "or any(joints.fault)", "", limp),
    (GUARD, 'if "encoder" in fault:', "if False:", limp),
    (GUARD, "if fault:  #", "if False:  #", limp),
    (GUARD, "if any(joints.rearmed):", "if False:", rearmed),
    (GUARD, "self._calm = followed", "self._calm = True", gentle),
    (MOTION, "        self.speed[i] = 0.0\n", "", rearmed),
    # slow passages
    (MOTION, "top = min(top, self.limits[i].speed_rad_s)", "pass", slow_joint),
    (MOTION, "soft = min(soft, self.limits[i].accel_rad_s2)", "pass", slow_joint),
    (GUARD, "min(top, self._gentle_speed)", "top", gentle),
    (GUARD, "min(accel, self._gentle_accel)", "accel", gentle),
    (GUARD, "and self._t_s >= self._gentle_until_s[i]", "or True", gentle),
    # collisions
    (COLLISIONS, "motion.wall_above(i, span.below)", "pass", collision),
    (COLLISIONS, "motion.wall_below(i, span.above)", "pass", collision),
    (MOTION, "self.high[i] = min(self.high[i], wall_rad)", "pass", collision),
    (MOTION, "self.low[i] = max(self.low[i], wall_rad)", "pass", collision),
    (
        COLLISIONS,
        "self._keeper[k] = keeper\n        _wall_off(pair[keeper], motion)",
        "pass",
        collision,
    ),
    (
        COLLISIONS,
        "eager = _crosses(pair[keeper], motion, desired)",
        "eager = False",
        collision,
    ),
    (
        COLLISIONS,
        "if not _side(pair[keeper], motion):\n            keeper",
        "if False:\n            keeper",
        collision_start,
    ),
    (
        MOTION,
        "stop = p + 0.5 * v * v / self.limits[i].accel_rad_s2 if v > 0.0 else p",
        "stop = p",
        collision_braking,
    ),
    (
        MOTION,
        "stop = p - 0.5 * v * v / self.limits[i].accel_rad_s2 if v < 0.0 else p",
        "stop = p",
        collision_braking,
    ),
    (COLLISIONS, "and _is_out(other, position)", "", collision_lag),
    (COLLISIONS, "                _wall_off(other, motion)", "                pass", collision_lag),
    (GUARD, "if i in self._collisions.exits:", "if False:", collision_start),
    (GUARD, "if i in self._collisions.still:", "if False:", collision_start),
    (GUARD, "slowly=True,", "", collision_start),
    (
        COLLISIONS,
        "_, joint, exit_rad = min(ways)",
        "_, joint, exit_rad = max(ways)",
        collision_start,
    ),
)


@pytest.mark.parametrize("check", CHECKS, ids=[check.__name__ for check in CHECKS])
def test_the_guard_as_it_is_passes(check: Callable[[ModuleType], None]) -> None:
    check(built())


@pytest.mark.parametrize(
    ("part", "old", "new", "check"),
    MUTATIONS,
    ids=[f"{check.__name__}: {old.strip()} -> {new.strip()}" for _, old, new, check in MUTATIONS],
)
def test_a_broken_guard_is_noticed(
    part: str, old: str, new: str, check: Callable[[ModuleType], None]
) -> None:
    broken = built(part, old, new)
    with pytest.raises(Exception) as noticed:
        check(broken)
    assert isinstance(
        noticed.value, AssertionError | ValueError | OverflowError | ZeroDivisionError
    )


def test_every_check_has_broken_guards_to_notice() -> None:
    assert {check for _, _, _, check in MUTATIONS} == set(CHECKS)

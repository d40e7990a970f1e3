"""Checks of limits, late ticks, health and torque: a broken guard does not pass them."""

from math import degrees, inf, nan, radians
from types import ModuleType

import pytest
from desk import GAZE_JOINTS
from guard_bench import ACCEL, DT, HIGH, JOINT, LOW, TOP, Bench

from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointState
from gazerig.robot.safety.guard import LATE_RAD_S2, SOFT_START_RAD_S2


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
        assert verdict.reasons == ("all: time does not advance",) and verdict.level == "hold"


def late(m: ModuleType) -> None:
    """A joint at full speed, ticks that do not come: it goes on from its goal, softly."""
    accel = 3.0 * LATE_RAD_S2
    limit = JointLimit(LOW, HIGH, radians(900.0), accel, 70.0, 3.5, 7.0)
    for missed in (2, 10, 400):
        guard = m.Guard(GuardParams(), (limit,) * 9, GAZE_JOINTS, period_s=DT)
        guard.reset(0.0, (LOW,) * 9)
        guard._gentle = [False] * 9
        t_s, before, speed = 0.0, LOW, 0.0
        for k in range(16):
            t_s += DT if k != 8 else missed * DT
            joints = JointState((before,) * 9, (0.0,) * 9, (t_s,) * 9, ())
            now = guard.check((HIGH,) * 9, joints, 0.0, t_s).command_rad[0]
            if k >= 8:
                braked = max(0.0, speed - accel * (missed - 1) * DT) if k == 8 else speed
                assert (now - before) / DT <= braked + LATE_RAD_S2 * DT + 1e-9
            before, speed = now, (now - before) / DT


def late_while_gentle(m: ModuleType) -> None:
    """Every third tick misses two slots: a slow joint regains its speed, and no more than that."""
    limit = JointLimit(LOW, HIGH, TOP, ACCEL, 70.0, 3.5, 7.0)
    params = GuardParams(soft_start_speed_deg_s=20.0)
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
            assert speed <= min(radians(20.0), fastest + SOFT_START_RAD_S2 * DT) + 1e-9
            braked = max(0.0, last - ACCEL * gap * DT)
            assert abs(speed - braked) <= ACCEL * DT + 1e-9
            if gap > 50:  # longer than that it begins as from rest
                assert speed <= braked + SOFT_START_RAD_S2 * DT + 1e-9
            fastest, last = max(fastest, speed), speed
        assert (now > LOW + 0.2) == (missed == 2)


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
    for _ in range(200):  # a servo without feedback is never found stalled
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

"""Servos are released when the loop that drives them dies or hangs."""

import os
import signal
import subprocess
import sys
from unittest.mock import Mock

import pytest
from child_processes import running_as
from feedback_rows import rows
from loop_deaths import PATIENCE_S, driven
from mixed_rig import mixed_rig
from sts_rig import Rig as StsRig

from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.process import child_process
from gazerig.robot.guardian.guardian import HUNG_S, RETRY_S, GuardedBus, Guardian
from gazerig.robot.guardian.heartbeat import (
    IDLE,
    RELEASED,
    RELEASING,
    HangDetector,
    Heartbeat,
)
from gazerig.robot.guardian.release_plan import ReleasePlan
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.run.buses import bus_ports, release_plans

PLAN = ReleasePlan("feetech", "/tmp/no such port", (1, 2), FeetechParams(), "feetech")


# --- a loop that dies, in a process of its own


@pytest.mark.parametrize("kind", ["dynamixel", "feetech", "maestro", "pca9685"])
def test_a_loop_that_hangs_and_dies_leaves_limp_servos(kind):
    with driven(kind) as it:
        assert all(it.holding())
        (guardian,) = it.guardians()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            os.kill(guardian, number)  # meant for the program: the guardian stays
        at_s = it.strike(signal.SIGSTOP)
        took_s = it.limp_after_s(at_s, PATIENCE_S)
        assert took_s is not None and took_s > 0.3, "not before it was sure"
        it.strike(signal.SIGCONT)
        it.line("rearmed")
        assert "did not run" in it.line("event the control loop")
        assert all(it.holding())
        os.kill(guardian, signal.SIGKILL)
        assert "started again" in it.line("event the guardian")
        assert it.guardians() != [guardian]
        assert it.limp_after_s(it.strike(signal.SIGKILL), PATIENCE_S) is not None


# --- which ports


def test_all_ports_are_guarded(tmp_path):
    rig = mixed_rig(tmp_path)
    plans = release_plans(rig, bus_ports(rig, None))
    kinds = {name: plan.kind for name, plan in plans.items()}
    assert kinds == {"": "maestro", "neck": "dynamixel", "tilt": "feetech"}
    assert plans["tilt"].ids == (1,)
    assert plans["tilt"].params.baud == rig.bus_named("tilt").section.baud


def test_the_guardian_is_light():
    code = (
        "import sys; from gazerig.robot.guardian.process import *;"
        "[releaser(ReleasePlan(k, '', (), None, k)) for k in ('feetech', 'maestro', 'dynamixel')]\n"
        "heavy = ('numpy', 'cv2', 'scipy', 'gazerig.config', 'pydantic')\n"
        "print([m for m in heavy if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --- when a loop counts as hung


def test_silence_of_four_tenths_is_a_hang_and_a_look_counts_a_tenth_at_most():
    detector = HangDetector(0, 0.0)
    rows = (
        (0, 0.05, False), (0, 0.10, False), (0, 0.37, False), (0, 0.47, False),  # 0.05 0.1 0.2 0.3
        (0, 0.46, False), (0, 0.55, False), (0, 0.56, True), (0, 3600.0, True),  # 0.3 0.39 0.4
        (1, 3601.0, False), (1, 7200.0, False), (1, 7200.05, False),  # 0.1 0.15: it was suspended
    )  # fmt: skip
    for beats, now_s, hung in rows:
        assert detector.step(beats, now_s) == hung
    assert detector.silent_s == pytest.approx(0.15)
    detector.reset()
    assert detector.silent_s == 0.0


# --- the program's side


TORQUE_ENABLE = 40  # of an STS servo


class Unattended(Guardian):
    """A guardian without a process: the test does what it would do."""

    def __init__(self):
        super().__init__((PLAN,))
        self.other = Heartbeat(self._fd)

    def join(self, plan):
        self._users.add(plan)

    def wait_until_ready(self):
        pass


def guarded(setups=None):
    rig, guardian = StsRig(setups=setups), Unattended()
    rig.inner = rig.bus  # type: ignore[attr-defined]
    rig.bus = GuardedBus(rig.inner, rig.setups, guardian, 0)  # type: ignore[attr-defined]
    rig.guardian = guardian  # type: ignore[attr-defined]
    rig.bus.open()
    return rig


@pytest.fixture
def sts():
    return guarded()


def test_it_watches_from_before_torque_on_until_torque_off(sts):
    other = sts.guardian.other
    assert not other.is_armed(0)
    enabled, sts.inner.enable_torque = sts.inner.enable_torque, refusing()
    with pytest.raises(ServoFault):
        sts.bus.enable_torque()
    assert other.is_armed(0), "some servos may have had their torque already"
    assert other.beats == 1
    sts.inner.enable_torque = enabled
    assert len(sts.bus.enable_torque()) == 4
    sts.bus.disable_torque()
    assert not other.is_armed(0)


def test_every_tick_is_a_sign_of_life(sts):
    sts.bus.enable_torque()
    before = sts.guardian.other.beats
    sts.run(0.1, [2000] * 4)
    assert sts.guardian.other.beats == before + 20  # a read and a write each


def test_traffic_of_one_call_counts_for_ten_seconds(monkeypatch):
    clock = SimulatedClock()
    monkeypatch.setattr("gazerig.robot.guardian.guardian.RealClock", lambda: clock)
    guardian = Unattended()
    guardian.beat()
    for now_s, beats in ((9.9, 2), (10.0, 2)):
        clock.sleep_until(now_s)
        guardian.beat_on_traffic()
        assert guardian.other.beats == beats


def test_a_loop_that_wakes_takes_hold_where_the_joints_are(sts):
    sts.bus.enable_torque()
    sts.run(0.3, [2200] * 4)
    other = sts.guardian.other
    other.set_state(0, RELEASING)
    count = len(sts.sent)
    assert rows(sts.bus.read(sts.now_s)) == (None,) * 4
    sts.bus.write([2900] * 4)
    assert len(sts.sent) == count, "hands off while the guardian speaks"
    for i in (1, 2, 3):  # the guardian's work
        sts.chain.find_servo(i).write(40, b"\0")
    other.set_state(0, RELEASED)
    readings = sts.tick(None)
    assert other.state(0) == IDLE
    assert all(r is not None and r.rearmed for r in readings)
    assert not any(r.rearmed for r in sts.tick(None))
    assert any("did not run" in line for line in sts.bus.events())
    moved = sts.run(0.5, [2250] * 4)[-1]
    assert moved is not None and moved.position_steps == pytest.approx(2250.0, abs=15.0)
    assert all(sts.get(i, 40) == 1 for i in (1, 2, 3))


def test_servos_that_refuse_are_asked_again_and_get_no_goals(sts):
    sts.bus.enable_torque()
    enabled, sts.inner.enable_torque = sts.inner.enable_torque, refusing()
    sts.guardian.other.set_state(0, RELEASED)
    readings = sts.run(2.5 * RETRY_S, [2300] * 4)
    assert not any(r.torque for r in readings if r is not None)
    lines = sts.bus.events()
    assert [line for line in lines if "too hot" in line] == [
        "torque could not be switched on again: servo 1: too hot"
    ], lines
    assert sts.inner.enable_torque.call_count == 3
    sts.inner.enable_torque = enabled
    sts.run(RETRY_S + 0.05, [2300] * 4)
    assert any("torque on again" in line for line in sts.bus.events())


def test_a_joint_far_outside_its_range_gets_no_torque_again():
    sts = guarded([setup._replace(far_steps=100.0) for setup in StsRig().setups])
    sts.bus.enable_torque()
    sts.run(0.3, [2000] * 4)
    sts.bus.events()
    for i in (1, 2, 3, 4):  # the guardian's work
        sts.chain.find_servo(i).write(TORQUE_ENABLE, b"\0")
    sts.command("turn 2 1500")
    sts.guardian.other.set_state(0, RELEASED)
    sts.run(2.5 * RETRY_S, [2000] * 4)
    assert not any(sts.get(i, TORQUE_ENABLE) for i in (1, 2, 3, 4))
    line = sts.bus.events()[-1]
    assert line.startswith(
        "torque could not be switched on again: jaw (servo 2) is at step 3500, far"
    )
    sts.command("turn 2 -1500")
    sts.command("lose 3 for 1.5")
    sts.run(RETRY_S + 0.1, [2000] * 4)
    assert "no position from neck (servo 3)" in str(sts.bus.events())
    sts.run(RETRY_S + 0.1, [2000] * 4)
    assert all(sts.get(i, TORQUE_ENABLE) for i in (1, 2, 3, 4))


def test_servos_that_nobody_held_stay_limp(sts):
    sts.bus.enable_torque()
    sts.bus.disable_torque()
    sts.guardian.other.set_state(0, RELEASED)
    sts.bus.events()
    sts.run(0.2, [2300] * 4)
    assert not sts.bus.events() and not any(sts.get(i, 40) for i in (1, 2, 3))


def refusing():
    return Mock(side_effect=ServoFault("servo 1: too hot"))


# --- the process, without any port


def test_it_ends_silently_when_all_is_off(capfd):
    guardian = Guardian((PLAN,))
    guardian.join(0)
    guardian.arm(0)
    own = os.getpid(), "gazerig.robot.guardian.process"
    assert running_as(*own)
    guardian.disarm(0)
    guardian.leave(0)
    guardian.leave(0)
    assert not running_as(*own)
    assert capfd.readouterr().err == ""


def test_without_a_guardian_there_is_no_torque(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    guardian = Guardian((PLAN,))
    guardian.join(0)
    with pytest.raises(SetupError, match="did not start"):
        guardian.arm(0)
    guardian.leave(0)


def test_one_that_ends_or_hangs_is_replaced_and_said(monkeypatch):
    started, suspended, guardian = list[Mock](), set[int](), Guardian((PLAN, PLAN))

    def start(module, fd, plans, pass_fds, **options):
        if len(started) == 5:
            raise OSError(11, "no process")
        started.append(Mock(pid=len(started), heartbeat=Heartbeat(*pass_fds)))
        return started[-1]

    monkeypatch.setattr(child_process, "start", start)
    monkeypatch.setattr(child_process, "is_suspended", lambda pid: pid in suspended)
    guardian.check(50.0)  # of none that runs
    guardian.join(0)

    def check(now_s, code=None, why="", looks=0):
        for _ in range(looks):
            started[-1].heartbeat.count_check()
        started[-1].poll.return_value, before = code, len(started)
        guardian.check(now_s)
        assert guardian.events() == ((f"the guardian {why}: started again",) if why else ())
        assert len(started) == before + bool(why)

    check(100.0)
    started[0].heartbeat.set_state(1, RELEASING)
    check(100.2, -9)  # four times a second
    check(100.25, -9, "ended unexpectedly (exit code -9)")
    assert [guardian.state(k) for k in (0, 1)] == [IDLE, RELEASED]
    check(105.2, 1)  # not more often than every five seconds
    check(105.5, 1, "ended unexpectedly (exit code 1)")
    check(200.0)  # it is still starting
    check(201.0, looks=3)
    check(201.0 + HUNG_S)
    check(203.5, None, "did not respond")
    assert [process.kill.called for process in started] == [False, False, True, False]
    assert all(process.stdin.close.called for process in started[:3])
    suspended.add(3)
    check(208.25)
    check(208.5, None, "did not respond")
    started[4].poll.return_value = 0
    guardian.check(220.0)
    assert guardian.events()[1] == "no guardian: no process; tried again in 5 s"

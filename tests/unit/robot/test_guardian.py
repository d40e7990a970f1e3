"""Servos are released when the loop that drives them dies or hangs."""

import os
import signal
import subprocess
import sys
import time

import pytest
from feedback_rows import rows
from loop_deaths import PATIENCE_S, driven
from mixed_rig import mixed_rig
from present import present
from sts_rig import Rig as StsRig

from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.drivers.process import child_process
from gazerig.robot.guardian.guardian import HUNG_S, RETRY_S, GuardedBus, Guardian
from gazerig.robot.guardian.heartbeat import (
    IDLE,
    RELEASED,
    RELEASING,
    HangDetector,
    Heartbeat,
)
from gazerig.robot.guardian.release_plan import ReleasePlan, describe
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


def test_plans_are_described():
    assert describe(PLAN) == "torque off on 2 servos of /tmp/no such port"
    board = ReleasePlan("maestro", "/dev/a 'b\"", (0, 5), MaestroParams(True, 24))
    assert describe(board) == "pulses off on 2 channels of /dev/a 'b\""


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
    refused, sts.inner.enable_torque = sts.inner.enable_torque, _refuse
    with pytest.raises(ServoFault):
        sts.bus.enable_torque()
    assert other.is_armed(0), "some servos may have had their torque already"
    sts.inner.enable_torque = refused
    sts.bus.enable_torque()
    assert other.is_armed(0)
    sts.bus.disable_torque()
    assert not other.is_armed(0)


def test_every_tick_is_a_sign_of_life(sts):
    sts.bus.enable_torque()
    before = sts.guardian.other.beats
    sts.run(0.1, [2000] * 4)
    assert sts.guardian.other.beats == before + 20  # a read and a write each


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
    sts.run(0.5, [2250] * 4)
    assert all(sts.get(i, 40) == 1 for i in (1, 2, 3))


def test_servos_that_refuse_are_asked_again_and_get_no_goals(sts):
    sts.bus.enable_torque()
    enabled, sts.inner.enable_torque = sts.inner.enable_torque, _refuse
    sts.guardian.other.set_state(0, RELEASED)
    readings = sts.run(2.5 * RETRY_S, [2300] * 4)
    assert not any(r.torque for r in readings if r is not None)
    lines = sts.bus.events()
    assert [line for line in lines if "too hot" in line] == [
        "torque could not be switched on again: servo 1: too hot"
    ], lines
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
    sts.run(RETRY_S + 0.1, [2000] * 4)
    assert all(sts.get(i, TORQUE_ENABLE) for i in (1, 2, 3, 4))


def test_servos_that_nobody_held_stay_limp(sts):
    sts.bus.enable_torque()
    sts.bus.disable_torque()
    sts.guardian.other.set_state(0, RELEASED)
    sts.bus.events()
    sts.run(0.2, [2300] * 4)
    assert not sts.bus.events() and not any(sts.get(i, 40) for i in (1, 2, 3))


def _refuse():
    raise ServoFault("servo 1: too hot")


# --- the process, without any port


@pytest.fixture
def guarding():
    guardian = Guardian((PLAN,))
    guardian.join(0)
    guardian.arm(0)
    yield guardian
    guardian.disarm(0)
    guardian.leave(0)


def test_it_ends_silently_when_all_is_off(capfd):
    guardian = Guardian((PLAN,))
    guardian.join(0)
    guardian.arm(0)
    pid = guardian.pid
    guardian.disarm(0)
    guardian.leave(0)
    guardian.leave(0)
    assert guardian.pid is None and not os.path.exists(f"/proc/{pid}")
    assert capfd.readouterr().err == ""


def test_without_a_guardian_there_is_no_torque(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    guardian = Guardian((PLAN,))
    guardian.join(0)
    with pytest.raises(SetupError, match="did not start"):
        guardian.arm(0)
    guardian.leave(0)


def test_one_that_dies_is_started_again_and_said(guarding):
    first = guarding.pid
    os.kill(present(first), signal.SIGKILL)
    now_s, end_s = 0.0, time.monotonic() + PATIENCE_S
    while guarding.pid == first and time.monotonic() < end_s:
        time.sleep(0.01)
        now_s += 1.0
        guarding.check(now_s)
    assert guarding.pid != first
    assert [line for line in guarding.events() if "exit code -9" in line]


def suspend(guardian):
    """Suspend a guardian that is at work; return its process id."""
    pid, checks = present(guardian.pid), guardian._heartbeat.checks
    end_s = time.monotonic() + PATIENCE_S
    while guardian._heartbeat.checks == checks and time.monotonic() < end_s:
        time.sleep(0.01)
    os.kill(pid, signal.SIGSTOP)
    while not child_process.is_suspended(pid) and time.monotonic() < end_s:
        time.sleep(0.01)
    return pid


def test_one_that_is_suspended_is_replaced_at_the_next_check(guarding):
    first = suspend(guarding)
    guarding.check(100.0)
    assert guarding.pid != first and not os.path.exists(f"/proc/{first}")
    assert guarding.events() == ("the guardian did not respond: started again",)
    guarding.wait_until_ready()


def test_one_that_looks_at_nothing_is_replaced(guarding, monkeypatch):
    guarding.check(0.0)
    first = suspend(guarding)
    monkeypatch.setattr(child_process, "is_suspended", lambda pid: False)
    guarding.check(100.0)
    guarding.check(100.0 + 0.9 * HUNG_S)
    assert guarding.pid == first
    guarding.check(100.1 + HUNG_S)
    assert guarding.pid != first
    guarding.check(200.0)  # the new one may still be starting
    assert len(guarding.events()) == 1

"""The guardian's own loop on a clock that is set: when it releases, what it tells, when it ends."""

import os
from types import SimpleNamespace
from typing import Any

import pytest

from gazerig.drivers.errors import BusLost
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.robot.guardian import process
from gazerig.robot.guardian.heartbeat import (
    IDLE,
    RELEASED,
    RELEASING,
    Heartbeat,
    shared_file,
)
from gazerig.robot.guardian.release_plan import ReleasePlan
from gazerig.robot.model.clock import SimulatedClock

PLANS = (
    ReleasePlan("feetech", "/dev/a", (1, 2), FeetechParams(), "feetech"),
    ReleasePlan("maestro", "/tmp/b", (0,), MaestroParams(True, 24)),
)


class Watched:
    """A guardian whose program beats until a time, and its attempts to release."""

    def __init__(self, patch: pytest.MonkeyPatch, silent_s: float, dies_s: float) -> None:
        self.clock, self.said, self.tries = SimulatedClock(), list[str](), list[tuple[Any, ...]]()
        self.silent_s, self.dies_s, self.unusable = silent_s, dies_s, 0
        self.unconfirmed: tuple[int, ...] = ()
        fd = shared_file()
        self.program, self.heartbeat = Heartbeat(fd), Heartbeat(fd)
        os.close(fd)
        for kind in ("feetech", "maestro"):
            patch.setitem(process.RELEASERS, kind, lambda plan: self.release)
        patch.setattr(process, "port_at_path", self.port)
        patch.setattr(process, "say", self.said.append)
        patch.setattr(process, "RealClock", lambda: self.clock)
        patch.setattr(process, "select", SimpleNamespace(select=self.look))
        patch.setattr(process, "sys", SimpleNamespace(stdin=SimpleNamespace(fileno=lambda: 0)))

    def run(self) -> None:
        process.ProgramWatch(self.heartbeat, PLANS, os.getppid()).run()

    def look(self, readable: list[int], _w: object, _x: object, wait_s: float) -> Any:
        self.clock.sleep_until(self.clock.now_s() + wait_s)
        if self.clock.now_s() < self.silent_s:
            self.program.beat()
        return (readable if self.clock.now_s() >= self.dies_s else []), [], []

    def port(self, path: str, exclusive: bool) -> Any:
        port = path, exclusive, round(self.clock.now_s(), 2)
        return SimpleNamespace(seen=port, closePort=lambda: self.tries.append(port))

    def release(self, port: Any) -> tuple[int, ...]:
        plan = int(port.seen[0] == "/tmp/b")
        self.states = [self.program.state(k) for k in (0, 1)]
        self.unusable -= 1
        if self.unusable >= 0:
            raise BusLost(f"no port {plan}")
        self.program.arm(plan, False)
        return self.unconfirmed


HUNG = "guardian: no heartbeat of the control loop for {} s"
DIED = "guardian: the program died"


def test_servos_are_released_four_tenths_after_the_last_heartbeat(monkeypatch):
    it = Watched(monkeypatch, silent_s=1.01, dies_s=2.0)
    it.unusable, it.unconfirmed = 1, (1, 2)
    it.program.arm(0, True)
    it.run()
    assert it.tries == [("/dev/a", False, 1.4), ("/dev/a", False, 1.66)]
    assert it.states == [RELEASING, IDLE]
    assert it.said == [
        f"{HUNG.format('0.4')}; not released yet: no port 0",
        f"{HUNG.format('0.7')}: torque off on 2 servos of /dev/a; not confirmed by 1, 2: "
        "cut the servo power",
    ]
    assert [it.program.state(k) for k in (0, 1)] == [RELEASED, IDLE]
    assert it.program.checks == 99  # one each 20 ms until its program has ended


def test_a_plan_is_released_once_until_the_loop_has_noticed(monkeypatch):
    it = Watched(monkeypatch, silent_s=0.0, dies_s=9.0)
    # Its pipe is held open by a child.
    monkeypatch.setattr(os, "getppid", lambda: 1 if it.clock.now_s() < 3.0 else 2)
    it.program.arm(1, True)
    it.program.set_state(1, RELEASED)
    it.run()
    assert it.tries == [("/tmp/b", False, 3.0)]
    assert it.said == [f"{DIED}: pulses off on 1 channel of /tmp/b"]


def test_servos_of_a_dead_program_are_released_and_an_unplugged_adaptor_is_waited_for(monkeypatch):
    it = Watched(monkeypatch, silent_s=1e9, dies_s=1.0)
    it.unusable = 1000
    for plan in (0, 1):
        it.program.arm(plan, True)
    it.run()
    times = [t_s for path, _, t_s in it.tries if path == "/dev/a"]
    assert times == pytest.approx([1.0 + 0.25 * n for n in range(42)])
    assert [path for path, *_ in it.tries].count("/tmp/b") == 1  # gone with its program
    assert [exclusive for _, exclusive, t_s in it.tries] == [t_s > 2.0 for *_, t_s in it.tries]
    assert it.said == [f"{DIED}; not released yet: no port {k}" for k in (0, 1)]

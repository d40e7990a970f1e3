"""Guardian process: releases the servos when their program dies or hangs.

Run by gazerig.robot.guardian.guardian as

    python -m gazerig.robot.guardian.process HEARTBEAT_FD PLANS

where PLANS is a tuple of ``ReleasePlan``, pickled and in base 85. One end of a pipe is its standard
input, whose other end the program holds, and a pipe is its standard output, to which it writes one
byte when it is ready. It shares nothing with the program but the memory of the heartbeat, and opens
a port only to release servos.

It ends when the program has ended or has closed the pipe; servos that are still armed are
released first. Signals to a whole group (Ctrl-C, a closed terminal, the end of a service) are
for the program and do not end the guardian.
"""

import base64
import contextlib
import os
import pickle
import select
import signal
import sys
from collections.abc import Callable

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.drivers.errors import DriverError
from gazerig.drivers.process.visible_text import visible
from gazerig.drivers.serial.port import BusPort, port_at_path
from gazerig.robot.guardian.heartbeat import IDLE, RELEASED, RELEASING, HangDetector, Heartbeat
from gazerig.robot.guardian.release_plan import ReleasePlan, describe
from gazerig.robot.model.clock import RealClock

LOOK_S = 0.02
"""Time between two checks of the heartbeat, s."""

RETRY_S = 0.25
"""Time between attempts to open a port, s."""

UNPLUGGED_S = 10.0
"""Longest wait for an adaptor that was unplugged when the program died, s."""

ALONE_S = 1.0
"""Time after the program's death from which another program may own the port, s."""


Releaser = Callable[[BusPort], tuple[int, ...]]


def releaser(plan: ReleasePlan) -> Releaser:
    """Return the function that releases the servos of a plan through a port.

    The function opens the port and returns the ids that did not confirm. It raises PortError if
    the port cannot be opened and BusLost if it is lost. Its modules are imported here.
    """
    return RELEASERS.get(plan.kind, _package_releaser)(plan)


def _smart(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.bus.servo_models import FAMILIES
    from gazerig.drivers.servo_bus.torque import disable_torque

    family = FAMILIES[plan.family]
    return lambda port: disable_torque(port, family, plan.params.baud, plan.ids)


def _maestro(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.hobby_board.board import stop_pulses
    from gazerig.drivers.maestro.board import MaestroBoard

    return lambda port: stop_pulses(MaestroBoard(port, plan.params), plan.ids)


def _pca9685(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.hobby_board.board import stop_pulses
    from gazerig.drivers.pca9685.board import Pca9685Board

    return lambda port: stop_pulses(Pca9685Board(port, plan.params), plan.ids)


def _package_releaser(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.plugins import BUS, BusPlugin, load

    release = load(BUS, plan.kind, BusPlugin).release
    assert release is not None, "a bus that needs no release has no plan"
    return lambda port: release(port, plan.params, plan.ids)


RELEASERS: dict[BusKind, Callable[[ReleasePlan], Releaser]] = {
    "dynamixel": _smart,
    "feetech": _smart,
    "maestro": _maestro,
    "pca9685": _pca9685,
}
"""Kind of bus -> function that returns the releaser of a plan; it imports its own drivers."""


class ProgramWatch:
    """Monitor of one program.

    Args:
        heartbeat: Memory shared with the program.
        plans: Servos to release, in the order of the records in the memory.
        parent: Process id of the program.
    """

    def __init__(self, heartbeat: Heartbeat, plans: tuple[ReleasePlan, ...], parent: int) -> None:
        self._heartbeat, self._plans, self._parent = heartbeat, plans, parent
        # Imported now, because the disk may be unavailable when it is needed.
        self._releasers = [releaser(plan) for plan in plans]
        self._complained: set[int] = set()
        self._clock = RealClock()
        self._hang = HangDetector(heartbeat.beats, self._clock.now_s())
        self._retry_s = 0.0

    def run(self) -> None:
        """Monitor the program until it ends or closes the pipe, then release armed servos."""
        while not self._is_program_gone():
            self._heartbeat.count_check()
            self._release_if_hung(self._clock.now_s())
        self._release_all()

    def _is_program_gone(self) -> bool:
        """Wait for ``LOOK_S``; return whether the program has ended or closed the pipe."""
        readable, _, _ = select.select([sys.stdin.fileno()], [], [], LOOK_S)
        # A child of the program may hold its end of the pipe open: check the parent's id, too.
        return bool(readable) or os.getppid() != self._parent

    def _release_if_hung(self, now_s: float) -> None:
        """Release armed servos if the loop hangs."""
        armed = self._armed_plans()
        if not armed:
            self._hang.reset()
        if not self._hang.step(self._heartbeat.beats, now_s) or now_s < self._retry_s:
            return
        for i in armed:
            if self._heartbeat.state(i) == IDLE:
                self._release_hung(i)

    def _armed_plans(self) -> list[int]:
        return [i for i in range(len(self._plans)) if self._heartbeat.is_armed(i)]

    def _release_hung(self, i: int) -> None:
        """Release one plan's servos while the program has the port open."""
        # Before the first byte: a loop that resumes now does not write until the release ends.
        self._heartbeat.set_state(i, RELEASING)
        why = f"no heartbeat of the control loop for {self._hang.silent_s:.1f} s"
        done = self._release(i, why, exclusive=False)
        self._heartbeat.set_state(i, RELEASED if done else IDLE)
        if not done:
            self._retry_s = self._clock.now_s() + RETRY_S

    def _release_all(self) -> None:
        """Release all armed servos; wait up to ``UNPLUGGED_S`` for adaptors that are unplugged."""
        began_s = self._clock.now_s()
        left = self._armed_plans()
        while left:
            since_s = self._clock.now_s() - began_s
            left = [i for i in left if not self._release(i, "the program died", since_s > ALONE_S)]
            # Only an adaptor can be plugged in again; an emulated port ends with its program.
            left = [i for i in left if self._plans[i].port.startswith("/dev/")]
            if since_s > UNPLUGGED_S:
                return
            if left:
                self._clock.sleep_until(self._clock.now_s() + RETRY_S)

    def _release(self, i: int, why: str, exclusive: bool) -> bool:
        """Release one plan's servos; return False if the port cannot be used."""
        plan = self._plans[i]
        port = port_at_path(plan.port, exclusive)
        try:
            unconfirmed = self._releasers[i](port)
        except DriverError as error:
            if i not in self._complained:
                say(f"guardian: {why}; not released yet: {error}")
            self._complained.add(i)
            return False
        finally:
            port.closePort()
        named = ", ".join(map(str, unconfirmed))
        unsure = f"; not confirmed by {named}: cut the servo power" if unconfirmed else ""
        say(f"guardian: {why}: {describe(plan)}{unsure}")
        return True


def say(line: str) -> None:
    """Write a line to standard error, which may be closed, for example with the terminal."""
    with contextlib.suppress(OSError):
        os.write(2, f"{visible(line)}\n".encode(errors="replace"))


def main(heartbeat_fd: int, plans: str) -> None:
    """Monitor the program that started this process."""
    parent = os.getppid()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    watch = ProgramWatch(Heartbeat(heartbeat_fd), pickle.loads(base64.b85decode(plans)), parent)
    with contextlib.suppress(BrokenPipeError):
        os.write(sys.stdout.fileno(), b".")
    watch.run()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])

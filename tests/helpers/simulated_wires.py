"""Emulated buses of the commands in this process and in simulated time: a silence costs nothing.

`with simulated_wires():` has what would be served on a pseudo-terminal by another process answer
here, whoever starts it: a test, or a command with --mock. The clock of the commands is that of
the servos, so that a search through 254 silent ids or a slow motion takes as long as its
arithmetic. What is not served here is opened as ever.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import pytest

from gazerig.drivers.serial import port as ports
from gazerig.drivers.serial.port import BlockingPort
from gazerig.robot.model.clock import RealClock, SimulatedClock
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import Emulated, build
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pty.client import PtyBuses

START_S = 1000.0
"""No port was opened at the beginning of time."""


class _Port(InProcessPort):
    """The host's end of an emulated device, by the path that it is served at."""

    def __init__(
        self, path: str, device: Device, clock: SimulatedClock, on_traffic: Callable[[], None]
    ) -> None:
        super().__init__(device, name=path, sleep_until=clock.sleep_until)
        self.opened_as = path
        self._on_traffic = on_traffic

    def write(self, data: bytes) -> None:
        self._on_traffic()
        super().write(data)

    def read_until(self, length: int, deadline_s: float) -> bytes:
        self._on_traffic()
        return super().read_until(length, deadline_s)


class _Wires:
    """The devices that are served, by path, and those of one server by the names of its buses."""

    def __init__(self, clock: SimulatedClock) -> None:
        self._clock = clock
        self._devices: dict[str, Device] = {}
        self._of: dict[PtyBuses, dict[str, str]] = {}
        self._terminals: dict[str, tuple[int, int]] = {}

    def start(
        self, server: PtyBuses, devices: Mapping[str, Emulated], world: object = None
    ) -> dict[str, str]:
        """Stands for PtyBuses.start."""
        assert world is None  # a world's servos answer on terminals alone
        paths: dict[str, str] = {}
        for name, served in devices.items():
            # The doctor looks whether a path is a serial port; nothing goes through this one.
            ends = os.openpty()
            paths[name] = path = os.ttyname(ends[1])
            self._devices[path], self._terminals[path] = build(served, self._clock.now_s), ends
        self._of[server] = paths
        return paths

    def command(self, server: PtyBuses, text: str, bus: str = "") -> str:
        """Stands for PtyBuses.command."""
        if server not in self._of:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._devices[self._of[server][bus]].faults.command(text)

    def stop(self, server: PtyBuses) -> None:
        """Stands for PtyBuses.stop."""
        for path in self._of.pop(server, {}).values():
            del self._devices[path]
            for end in self._terminals.pop(path):
                os.close(end)

    def port(
        self, path: str, exclusive: bool = True, on_traffic: Callable[[], None] | None = None
    ) -> InProcessPort | BlockingPort:
        if path not in self._devices:
            return BlockingPort(path, exclusive, on_traffic)
        heard = on_traffic if on_traffic is not None else lambda: None
        return _Port(path, self._devices[path], self._clock, heard)


@contextmanager
def simulated_wires() -> Iterator[SimulatedClock]:
    """Serve emulated buses in this process meanwhile; give the time that commands live in."""
    clock = SimulatedClock(START_S)
    with pytest.MonkeyPatch.context() as patch:
        wires = _Wires(clock)
        patch.setattr(PtyBuses, "start", lambda server, *given: wires.start(server, *given))
        patch.setattr(
            PtyBuses, "command", lambda server, text, bus="": wires.command(server, text, bus)
        )
        patch.setattr(PtyBuses, "stop", lambda server: wires.stop(server))
        patch.setattr(ports, "BlockingPort", wires.port)
        patch.setattr(RealClock, "now_s", lambda _: clock.now_s())
        patch.setattr(RealClock, "sleep_until", lambda _, t_s: clock.sleep_until(t_s))
        yield clock

"""One emulated device on a pseudo-terminal, which passes bytes until it is closed."""

import json
import os
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import Emulated, build
from gazerig.sim_mock.pty.terminal import Terminal
from gazerig.sim_mock.smart_servo.chain import ServoChain
from gazerig.sim_mock.wire import ServoLine

_PACKET_GAP_S = 0.05
"""1.5 ms on a real line; here the host's scheduler may split a packet for longer."""
IDLE_S = 0.5
LOOK_S = 0.005
"""Interval of checks for faults that end by time."""


@dataclass(frozen=True)
class BusSettings:
    """Settings of one emulated bus on a terminal.

    device: its specification; clients at a baud rate other than its own get no answer
    name: name of this bus among several in one process; None if it is the only one
    wire_time: as in gazerig.sim_mock.wire
    link: name under which the terminal can be opened, also after it was unplugged
    """

    device: Emulated
    name: str | None = None
    wire_time: bool = False
    link: str | None = None


class TerminalLine:
    """Passes bytes between a terminal and a device.

    Args:
        settings: the device and its line.
        now_s: the clock of device and line.
        device: a device; None: it is built from its specification, with its own mechanics.

    Attributes:
        heard: whether a client has sent anything yet.

    Raises:
        ValueError, OSError: the settings are invalid.
    """

    def __init__(
        self, settings: BusSettings, now_s: Callable[[], float], device: Device | None = None
    ) -> None:
        self._settings, self._now_s = settings, now_s
        self.device = device or build(settings.device, now_s)
        if isinstance(self.device, ServoChain):
            self.device.packet_gap_s = _PACKET_GAP_S
        self.line = ServoLine(self.device, settings.wire_time)
        link = None if settings.link is None else Path(os.path.abspath(settings.link))
        self.terminal = Terminal(link)
        self.heard = False

    def address_json(self) -> str:
        """Return the path to open, the baud rate, and the name, if it has one, as JSON."""
        return self._json(path=self.terminal.path, baud=self._settings.device.baud)

    def close(self) -> None:
        """Remove the link and the terminal; safe to call twice."""
        self.terminal.unplug()

    def watched_files(self) -> list[int]:
        """Return the files that become readable when ``serve`` is needed."""
        terminal = self.terminal
        return [terminal.master, terminal.clients] if terminal.is_plugged else []

    def wait_s(self) -> float:
        """Return how long to sleep unless bytes arrive, in seconds."""
        due_s = self.line.next_due_s()
        if due_s is not None:
            return max(0.0, due_s - self._now_s())
        return LOOK_S if self.device.faults.has_any else IDLE_S

    def serve(self, ready: Collection[int]) -> None:
        """Process all that is due; ``ready``: the files that are readable."""
        terminal = self.terminal
        if terminal.master in ready:
            data = terminal.read()
            self.heard = self.heard or bool(data)
            terminal.write(self.line.send(data, terminal.client_baud() or 1))
        if terminal.clients in ready:  # after the last client's bytes, whose answers it drops
            terminal.count_clients()
        if self.line.is_busy and terminal.is_plugged:
            terminal.write(self.line.take_arrived())
        self._follow_faults()

    def obey(self, text: str) -> str:
        """Run a fault command; return {"ok": ...} or {"error": ...} as JSON."""
        try:
            done = self.device.faults.command(text)
        except ValueError as error:
            return self._json(error=str(error))
        self._follow_faults()
        return self._json(ok=done)

    def _json(self, **message: object) -> str:
        name = self._settings.name
        return json.dumps(message if name is None else {"bus": name, **message})

    def _follow_faults(self) -> None:
        """Unplug the terminal, or plug it in again."""
        if self.device.faults.is_on("unplug"):
            self.terminal.unplug()
            self.line.forget()
        elif not self.terminal.is_plugged:
            self.terminal.plug()

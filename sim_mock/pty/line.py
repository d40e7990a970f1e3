"""One emulated device on a pseudo-terminal, which passes bytes until it is closed."""

import json
import os
from collections.abc import Callable, Collection, Mapping
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
        say: receives the bus's new path as JSON when it is plugged in again without a link.
        warn: called once for each wrong baud rate of a client.
        device: a device; None: it is built from its specification, with its own mechanics.

    Raises:
        ValueError, OSError: the settings are invalid.
    """

    def __init__(
        self,
        settings: BusSettings,
        now_s: Callable[[], float],
        say: Callable[[str], None],
        warn: Callable[[str], None] | None = None,
        device: Device | None = None,
    ) -> None:
        self.settings = settings
        self._now_s, self._say, self._warn = now_s, say, warn
        self.device = device or build(settings.device, now_s)
        if isinstance(self.device, ServoChain):
            self.device.packet_gap_s = _PACKET_GAP_S
        self.line = ServoLine(self.device, settings.wire_time)
        link = None if settings.link is None else Path(os.path.abspath(settings.link))
        self.terminal = Terminal(link)
        self._warned: int | None = None
        self.heard = False
        """Whether a client has sent anything yet."""

    def address_json(self) -> str:
        """Return the path to open, the baud rate, and the name, if it has one, as JSON."""
        return self._message({"path": self.terminal.path, "baud": self.settings.device.baud})

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
        return LOOK_S if self.device.faults.wire.has_any else IDLE_S

    def serve(self, ready: Collection[int], now_s: float) -> None:
        """Process all that is due; ``ready``: the files that are readable since ``now_s``."""
        terminal = self.terminal
        if terminal.master in ready:
            data = terminal.read()
            self.heard = self.heard or bool(data)
            careful = self.device.check_baud or self.line.wire_time
            baud = terminal.client_baud() if careful else 0
            terminal.write(self.line.send(data, baud or 1, now_s))
            if data and self.device.check_baud and baud != self._warned:
                self._warn_of_baud(baud)
        if terminal.clients in ready:  # after the last client's bytes, whose answers it drops
            terminal.count_clients()
        if self.line.is_busy:
            data = self.line.take_arrived()
            if terminal.is_plugged:
                terminal.write(data)
        self._follow_faults()

    def obey(self, text: str) -> str:
        """Run a fault command; return {"ok": ...} or {"error": ...} as JSON."""
        try:
            done = self.device.faults.command(text)
        except ValueError as error:
            return self._message({"error": str(error)})
        self._follow_faults()
        if done.startswith("{"):
            return self._message({"ok": "status", **json.loads(done)})
        return self._message({"ok": done})

    def _message(self, message: Mapping[str, object]) -> str:
        """Return a message about this bus as JSON, with the bus's name."""
        name = self.settings.name
        return json.dumps(message if name is None else {"bus": name, **message})

    def _warn_of_baud(self, baud: int) -> None:
        if self._warn is not None and not self.device.understands_baud(baud):
            self._warned = baud
            own = self.settings.device.baud
            self._warn(f"a client sends at {baud} bit/s; the servos listen at {own}")

    def _follow_faults(self) -> None:
        """Apply the faults of the adapter to the terminal."""
        faults, terminal = self.device.faults, self.terminal
        if faults.is_on("unplug"):
            terminal.unplug()
            self.line.forget()
            return
        if not terminal.is_plugged:
            before = terminal.path
            terminal.plug()
            if terminal.path != before:
                self._say(self._message({"path": terminal.path}))

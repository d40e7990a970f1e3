"""One emulated device on a pseudo-terminal, which passes bytes until it is closed."""

import json
import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gazerig.sim_mock.device import Device
from gazerig.sim_mock.device_cases import CASES
from gazerig.sim_mock.devices import Emulated, build
from gazerig.sim_mock.pty.terminal import Terminal
from gazerig.sim_mock.wire import ServoLine

PACKET_GAP, GAP_MS = "packet-gap-ms", 50.0
"""1.5 ms on a real line; here the host's scheduler may split a packet for longer."""

SPIN_S = 0.0001
"""Largest delay of the kernel's wake-up: the last part of a wait is a busy loop."""

IDLE_S = 0.5
"""Interval of checks for signals while nothing else happens."""
LOOK_S = 0.005
"""Interval of checks for faults that end by time."""


@dataclass(frozen=True)
class BusSettings:
    """Settings of one emulated bus on a terminal.

    device: its specification; clients at a baud rate other than its own get no answer
    name: name of this bus among several in one process; None if it is the only one
    wire_time, turnaround_us: as in gazerig.sim_mock.wire
    link: name under which the terminal can be opened, also after it was unplugged
    choices: cases of the device by name
    seed: seed of the random numbers of faults
    """

    device: Emulated
    name: str | None = None
    wire_time: bool = False
    turnaround_us: float = 0.0
    link: str | None = None
    choices: Mapping[str, str] = field(default_factory=dict)
    seed: int = 0


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
        self.device = device or build(settings.device, now_s, settings.seed)
        # The device waits longer for the rest of a packet than its own time.
        patient = PACKET_GAP in CASES.get(settings.device.kind, {})
        choices = {PACKET_GAP: str(GAP_MS)} if patient else {}
        for case, value in {**choices, **settings.choices}.items():
            self.device.choose_behaviour(case, value)
        self.line = ServoLine(self.device, settings.wire_time, settings.turnaround_us * 1e-6)
        link = None if settings.link is None else Path(os.path.abspath(settings.link))
        self.terminal = Terminal(link, settings.device.baud)
        self._held = self._forbidden = False
        self._warned: int | None = None
        self.heard = False
        """Whether a client has sent anything yet."""

    def address_json(self) -> str:
        """Return the path to open, the baud rate, and the name, if it has one, as JSON."""
        return self.label_message({"path": self.terminal.path, "baud": self.settings.device.baud})

    def label_message(self, message: Mapping[str, object]) -> str:
        """Return a message about this bus as JSON, with the bus's name."""
        name = self.settings.name
        return json.dumps(message if name is None else {"bus": name, **message})

    def close(self) -> None:
        """Remove the link and the terminal; safe to call twice."""
        self.terminal.unplug()

    # --- bytes

    def watched_files(self) -> list[int]:
        """Return the files that become readable when ``serve`` is needed."""
        watch = self.terminal.watch
        return [fd for fd in (self.terminal.master, -1 if watch is None else watch.fd) if fd >= 0]

    def wait_s(self) -> float:
        """Return how long to sleep unless bytes arrive, in seconds."""
        due_s = self.line.next_due_s()
        if due_s is not None:
            return max(0.0, due_s - SPIN_S - self._now_s())
        return LOOK_S if self.device.faults.wire.has_any else IDLE_S

    def serve(self, ready: Collection[int], now_s: float) -> None:
        """Process all that is due; ``ready``: the files that are readable since ``now_s``."""
        watch = self.terminal.watch
        if watch is not None and watch.fd in ready and watch.process_events():
            self.terminal.release()
        if self.terminal.master in ready:
            data = self.terminal.read()
            self.heard = self.heard or bool(data)
            careful = self.device.check_baud or self.line.wire_time
            baud = self.terminal.client_baud() if careful else 0
            answer = self.line.send(data, baud or 1, now_s)
            if answer:
                self.terminal.write(answer)
            new = self.device.check_baud and data and baud != self._warned
            if self._warn is not None and new and not self.device.understands_baud(baud):
                self._warned = baud
                device = self.settings.device
                rate = "another rate" if device.baud is None else device.baud
                self._warn(f"a client sends at {baud} bit/s; {device.listens} at {rate}")
        if self.line.is_busy:
            self._deliver()
        if self.device.faults.wire.has_any or self._held or self._forbidden:
            self._follow_faults()
        elif not self.terminal.is_plugged:
            self._plug()

    def _deliver(self) -> None:
        """Write bytes that are due; the last 0.1 ms of the wait is a busy loop."""
        due_s = self.line.next_due_s()
        if due_s is not None:
            if due_s - self._now_s() > SPIN_S:
                return
            while self._now_s() < due_s:
                pass
        data = self.line.take_arrived()
        if data and self.terminal.is_plugged:
            self.terminal.write(data)

    # --- faults of the adapter

    def _follow_faults(self) -> None:
        """Apply the faults of the adapter to the terminal."""
        faults = self.device.faults
        if faults.is_on("unplug") == self.terminal.is_plugged:
            if self.terminal.is_plugged:
                self.terminal.unplug()
                self.line.forget()
                self._held = self._forbidden = False
            else:
                self._plug()
        if not self.terminal.is_plugged:
            return
        if faults.is_on("block") != self._held:
            self._held = not self._held
            self.terminal.hold(self._held)
        if faults.is_on("deny") != self._forbidden:
            self._forbidden = not self._forbidden
            self.terminal.forbid(self._forbidden)

    def _plug(self) -> None:
        before = self.terminal.path
        self.terminal.plug()
        if self.terminal.path != before:
            self._say(self.label_message({"path": self.terminal.path}))

    # --- commands

    def obey(self, text: str) -> str:
        """Run a fault command; return {"ok": ...} or {"error": ...} as JSON."""
        try:
            done = self.device.faults.command(text)
        except ValueError as error:
            return self.label_message({"error": str(error)})
        self._follow_faults()
        if done.startswith("{"):
            return self.label_message({"ok": "status", **json.loads(done)})
        return self.label_message({"ok": done})

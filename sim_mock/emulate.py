"""An emulated servo bus on a pseudo-terminal, in a process of its own.

``python -m sim_mock.emulate '{"servos": [[1, "xl330-m077", 2048]], ...}'`` prints one
JSON line with the terminal's path and serves clients that come and go. It takes commands
as lines on standard input and answers each with one JSON line: {"ok": ...} or
{"error": ...}. Imports nothing heavy, so that it is up within a tenth of a second.

A server in a thread of the client's own process would fight it for the interpreter lock.
"""

import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from sim_mock.servo import ServoSpec
from sim_mock.servo_chain import ServoChain, build_chain
from sim_mock.servo_line import ServoLine
from sim_mock.terminal import Terminal

GAP_MS = 50.0
"""On a real line 1.5 ms; here the host's scheduler may tear a packet apart for longer."""

SPIN_S = 0.0001
"""The kernel wakes a sleeper up to so late: the rest until bytes are due is spun away."""

IDLE_S = 0.5
"""So often it is looked whether a signal came, while nothing else happens."""
LOOK_S = 0.005
"""How often faults that end by themselves are looked at."""


@dataclass(frozen=True)
class Settings:
    """What to emulate.

    servos: id, model, start position in steps and firmware of each
    baud: the servos' rate, clients at another are not heard; None: every client is
    wire_time, turnaround_us: as in sim_mock.servo_line
    link: name under which the terminal can be opened, also after it was unplugged
    until_eof: end when standard input does
    choices: cases of sim_mock.servo_habits by name
    """

    servos: tuple[ServoSpec, ...]
    baud: int | None = None
    wire_time: bool = False
    turnaround_us: float = 0.0
    link: str | None = None
    until_eof: bool = False
    choices: Mapping[str, str] = field(default_factory=dict)
    seed: int = 0


class Stopped(Exception):
    """SIGTERM or Ctrl-C came."""


class Server:
    """Passes bytes between a terminal and a line until told to stop."""

    def __init__(self, settings: Settings, say: Callable[[str], None]) -> None:
        self._settings = settings
        self._say = say
        self.chain: ServoChain = build_chain(
            settings.servos, time.monotonic, baud=settings.baud, seed=settings.seed
        )
        for case, value in {"packet-gap-ms": str(GAP_MS), **settings.choices}.items():
            self.chain.choose(case, value)
        self.line = ServoLine(self.chain, settings.wire_time, settings.turnaround_us * 1e-6)
        link = None if settings.link is None else Path(os.path.abspath(settings.link))
        self.terminal = Terminal(link, settings.baud)
        self._held = self._forbidden = False
        self._typed = b""
        self._warned: int | None = None
        self.over = False
        """To be set by a signal: an exception alone may be swallowed where it arises."""

    def serve(self, commands: int | None) -> None:
        """Serve until ``commands`` ends, where the settings say so, or a signal stops it."""
        try:
            while not self.over:
                master, watch = self.terminal.master, self.terminal.watch
                leaving = -1 if watch is None else watch.fd
                watched = [fd for fd in (master, leaving, commands) if fd is not None and fd >= 0]
                ready, _, _ = select.select(watched, (), (), self._patience_s())
                now_s = time.monotonic()
                if watch is not None and leaving in ready and watch.look():
                    self.terminal.release()
                if commands in ready and not self._take_commands(commands):
                    if self._settings.until_eof:
                        return
                    commands = None
                if master in ready and master == self.terminal.master:
                    self._take_bytes(now_s)
                if self.line.busy:
                    self._deliver()
                if self.chain.faults.wire.any or self._held or self._forbidden:
                    self._follow_faults()
                elif not self.terminal.plugged:
                    self._plug()
        finally:
            self.terminal.unplug()

    def _patience_s(self) -> float:
        """Give how long nothing needs to be done but for what arrives."""
        due_s = self.line.next_due_s()
        if due_s is not None:
            return max(0.0, due_s - SPIN_S - time.monotonic())
        return LOOK_S if self.chain.faults.wire.any else IDLE_S

    def _take_bytes(self, now_s: float) -> None:
        """Give the client's bytes to the line, and back what is answered at once."""
        data = self.terminal.read()
        careful = self.chain.heed_baud or self.line.wire_time
        baud = self.terminal.client_baud() if careful else 0
        answer = self.line.send(data, baud or 1, now_s)
        if answer:
            self.terminal.write(answer)
        if self.chain.heed_baud and not self._settings.until_eof:
            self._warn(baud)

    def _deliver(self) -> None:
        """Hand over what is due; the last moment before that is waited for exactly."""
        due_s = self.line.next_due_s()
        if due_s is not None:
            if due_s - time.monotonic() > SPIN_S:
                return
            while time.monotonic() < due_s:
                pass
        data = self.line.arrived()
        if data and self.terminal.plugged:
            self.terminal.write(data)

    def _warn(self, baud: int) -> None:
        """Tell a person, once for each rate, that a client speaks at the wrong one."""
        if baud == self._warned or self.chain.hears(baud):
            return
        self._warned = baud
        heard = f"a client speaks at {baud} bit/s; the servos listen at {self._settings.baud}"
        sys.stderr.write(heard + "\n")

    # --- faults of the adapter

    def _follow_faults(self) -> None:
        """Make the terminal as the faults in force say."""
        faults = self.chain.faults
        if faults.on("unplug") == self.terminal.plugged:
            if self.terminal.plugged:
                self._unplug()
            else:
                self._plug()
        if not self.terminal.plugged:
            return
        if faults.on("block") != self._held:
            self._held = not self._held
            self.terminal.hold(self._held)
        if faults.on("deny") != self._forbidden:
            self._forbidden = not self._forbidden
            self.terminal.forbid(self._forbidden)

    def _unplug(self) -> None:
        self.terminal.unplug()
        self.line.forget()
        self._held = self._forbidden = False

    def _plug(self) -> None:
        before = self.terminal.path
        self.terminal.plug()
        if self.terminal.path != before:
            self._say(json.dumps({"path": self.terminal.path}))

    # --- commands

    def _take_commands(self, commands: int | None) -> bool:
        """Carry out the lines that have come; False at the end of standard input."""
        assert commands is not None
        try:
            came = os.read(commands, 4096)
        except OSError:  # a terminal that another job owns now
            return False
        *lines, self._typed = (self._typed + came).split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip()
            if text:
                self._say(self._obey(text))
        return bool(came)

    def _obey(self, text: str) -> str:
        try:
            done = self.chain.faults.command(text)
        except ValueError as error:
            return json.dumps({"error": str(error)})
        self._follow_faults()
        if done.startswith("{"):
            return json.dumps({"ok": "status", **json.loads(done)})
        return json.dumps({"ok": done})


def run(settings: Settings, say: Callable[[str], None], heed_ctrl_c: bool) -> None:
    """Serve until SIGTERM, Ctrl-C where it is heeded, or the end of standard input.

    Raises:
        ValueError, OSError: the settings cannot be met.
    """

    servers: list[Server] = []

    def stop(number: int, frame: FrameType | None) -> None:
        for server in servers:
            server.over = True
        raise Stopped

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop if heed_ctrl_c else signal.SIG_IGN)
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    try:
        server = Server(settings, say)
        servers.append(server)
        say(json.dumps({"path": server.terminal.path, "baud": settings.baud}))
        server.serve(sys.stdin.fileno() if sys.stdin is not None else None)
    except (Stopped, BrokenPipeError):
        return


def say(line: str) -> None:
    """Write one line to standard output at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Serve what the settings on the command line say."""
    given: dict[str, Any] = json.loads(sys.argv[1])
    given["servos"] = tuple(ServoSpec(*spec) for spec in given["servos"])
    run(Settings(**given), say, heed_ctrl_c=False)


if __name__ == "__main__":
    main()

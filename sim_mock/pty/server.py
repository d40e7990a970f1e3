"""Emulated servos and boards on pseudo-terminals, in their own process.

It prints one JSON line per bus with its terminal's path and serves clients that connect and
disconnect. It reads commands as lines from standard input and answers each with one JSON line:
{"ok": ...} or {"error": ...}. With several buses a command begins with the name of its bus:
``neck: lose 3``; a command without a name is for the bus without one. It imports nothing heavy, so
that it starts within a tenth of a second; surroundings in its settings are created there, and all
servos of all buses are in them.

A server in a thread of the client's process would compete with it for the interpreter lock.
"""

import json
import os
import pickle
import select
import signal
import sys
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process.priority import SHORT_S, request_slice
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.faults.grammar import bus_and_command
from gazerig.sim_mock.pty.line import BusSettings, TerminalLine


class ServedSurroundings(Protocol):
    """Surroundings that contain all servos of a server."""

    @property
    def commands(self) -> Collection[str]:
        """Return the first words of the surroundings' commands."""
        ...

    def joints(self) -> dict[str, int]:
        """Return the index of each joint in a state."""
        ...

    def device(self, bus: BusSettings) -> Device:
        """Return the emulated device of a bus, whose servos are in it."""
        ...

    def obey(self, text: str) -> str:
        """Run a command; return {"ok": ...} or {"error": ...} as JSON."""
        ...

    def wait_s(self) -> float:
        """Return how long to sleep unless bytes arrive, in seconds."""
        ...

    def serve(self, heard: bool) -> None:
        """Advance to the present time; heard: a client has sent bytes."""
        ...


MakeSurroundings = Callable[[Callable[[], float]], ServedSurroundings]
"""Creates surroundings on a clock in the server's process.

Raises:
    SetupError: they cannot be used.
"""


@dataclass(frozen=True)
class ServerSettings:
    """Devices to emulate.

    Attributes:
        buses: each on its own terminal.
        until_eof: stop at the end of standard input.
        surroundings: surroundings of all servos; None: each servo has its own mechanics.
    """

    buses: tuple[BusSettings, ...]
    until_eof: bool = False
    surroundings: MakeSurroundings | None = None


class Server:
    """Serves every bus on its own terminal until it is stopped.

    Raises:
        ValueError, OSError, SetupError: the settings are invalid.
    """

    def __init__(self, settings: ServerSettings, say: Callable[[str], None]) -> None:
        self._until_eof, self._say = settings.until_eof, say
        self._partial_command = b""
        self.lines: dict[str, TerminalLine] = {}
        self.surroundings: ServedSurroundings | None = None
        if settings.surroundings is not None:
            self.surroundings = settings.surroundings(time.monotonic)
        try:
            for bus in settings.buses:
                device = None if self.surroundings is None else self.surroundings.device(bus)
                line = TerminalLine(bus, time.monotonic, device)
                self.lines[bus.name or ""] = line
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Remove all terminals."""
        for line in self.lines.values():
            line.close()

    def serve(self, commands: int | None, stop: int) -> None:
        """Serve until ``stop`` becomes readable, or until ``commands`` ends, if that is set."""
        lines = self.lines.values()
        while True:
            watched = [stop, *(fd for line in lines for fd in line.watched_files())]
            wait_s = min([line.wait_s() for line in lines])
            if commands is not None:
                watched.append(commands)
            if self.surroundings is not None:
                wait_s = min(wait_s, self.surroundings.wait_s())
            ready, _, _ = select.select(watched, (), (), wait_s)
            if stop in ready:
                return
            for line in lines:
                line.serve(ready)
            # Afterwards, as a command may close terminals that were ready.
            if commands in ready and not self._take_commands(commands):
                if self._until_eof:
                    return
                commands = None
            if self.surroundings is not None:
                self.surroundings.serve(any([line.heard for line in lines]))

    def _take_commands(self, commands: int | None) -> bool:
        """Run received command lines; return False at the end of standard input."""
        assert commands is not None
        try:
            came = os.read(commands, 4096)
        except OSError:  # the terminal belongs to another job now
            return False
        *lines, self._partial_command = (self._partial_command + came).split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip()
            if text:
                self._say(self._obey(text))
        return bool(came)

    def _obey(self, text: str) -> str:
        """Run a command: in the surroundings, on its bus, or on the bus without a name."""
        if self.surroundings is not None and text.split()[0] in self.surroundings.commands:
            return self.surroundings.obey(text)
        try:
            name, command = bus_and_command(text, self.lines)
        except ValueError as error:
            return json.dumps({"error": str(error)})
        return self.lines[name].obey(command)


def run(settings: ServerSettings, say: Callable[[str], None], heed_ctrl_c: bool) -> None:
    """Serve until SIGTERM, Ctrl-C (if ``heed_ctrl_c``), or the end of standard input.

    Raises:
        ValueError, OSError: the settings are invalid.
    """
    stop, wake = os.pipe()
    os.set_blocking(wake, False)

    def end(number: int, frame: object) -> None:
        os.write(wake, b"x")

    signal.signal(signal.SIGTERM, end)
    signal.signal(signal.SIGINT, end if heed_ctrl_c else signal.SIG_IGN)
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    try:
        server = Server(settings, say)
    except SetupError as error:
        say(json.dumps({"error": str(error)}))
        return
    try:
        if server.surroundings is not None:
            say(json.dumps({"joints": server.surroundings.joints()}))
        for line in server.lines.values():
            say(line.address_json())
        server.serve(sys.stdin.fileno() if sys.stdin is not None else None, stop)
    except BrokenPipeError:
        return
    finally:
        server.close()


def say(line: str) -> None:
    """Write one line to standard output immediately."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Serve the buses of the settings in the file on the command line, as ``client`` packs them."""
    request_slice(SHORT_S)  # servos do not wait for a browser
    run(pickle.loads(Path(sys.argv[1]).read_bytes()), say, heed_ctrl_c=False)


if __name__ == "__main__":
    main()

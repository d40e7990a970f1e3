"""Emulated servos and boards on pseudo-terminals, in their own process.

``python -m gazerig.sim_mock.pty.server '{"buses": [{"device": {"kind": "dynamixel", "servos":
[[1, "xl330-m077", 2048]]}}]}'`` prints one JSON line per bus with its terminal's path and serves
clients that connect and disconnect. It reads commands as lines from standard input and answers
each with one JSON line: {"ok": ...} or {"error": ...}. With several buses a command begins with
the name of its bus: ``neck: lose 3``; a command without a name is for the bus without one. It
imports nothing heavy, so that it starts within a tenth of a second; with "surroundings" in its
settings it creates these, and all servos of all buses are in them.

A server in a thread of the client's process would compete with it for the interpreter lock.
"""

import json
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any, Protocol

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process.priority import SHORT_S, request_slice
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import device_of_data
from gazerig.sim_mock.pty.line import BusSettings, TerminalLine

_LOOK_MS = 200


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


@dataclass(frozen=True)
class SurroundingsSettings:
    """How to create surroundings.

    Attributes:
        factory: "module:function".
        folder: holds their data; the function receives it and the clock.
    """

    factory: str
    folder: str

    def create(self) -> ServedSurroundings:
        """Return the surroundings.

        Raises:
            SetupError: they cannot be used.
        """
        module, _, function = self.factory.partition(":")
        make = getattr(import_module(module), function)
        made: ServedSurroundings = make(Path(self.folder), time.monotonic)
        return made


@dataclass(frozen=True)
class ServerSettings:
    """Devices to emulate.

    Attributes:
        buses: each on its own terminal.
        until_eof: stop at the end of standard input.
        surroundings: surroundings of all servos; None: each has its own mechanics.
    """

    buses: tuple[BusSettings, ...]
    until_eof: bool = False
    surroundings: SurroundingsSettings | None = None


class ServerStopped(Exception):
    """SIGTERM or Ctrl-C was received."""


class Server:
    """Serves every bus on its own terminal until it is stopped."""

    def __init__(self, settings: ServerSettings, say: Callable[[str], None]) -> None:
        self._settings = settings
        self._say = say
        warn = None if settings.until_eof else _warn
        self.lines: list[TerminalLine] = []
        self._partial_command = b""
        self.is_over = False
        """Set by a signal handler: an exception alone may be swallowed where it is raised."""
        names = [bus.name for bus in settings.buses]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"every bus needs its own name; given {names}")
        try:
            self.surroundings: ServedSurroundings | None = None
            if settings.surroundings is not None:
                with _exit_with_client(settings.until_eof):
                    self.surroundings = settings.surroundings.create()
            for bus in settings.buses:
                device = None
                if self.surroundings is not None:
                    device = self.surroundings.device(bus)
                self.lines.append(TerminalLine(bus, time.monotonic, say, warn, device))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Remove all terminals."""
        for line in self.lines:
            line.close()

    def serve(self, commands: int | None) -> None:
        """Serve until ``commands`` ends, if the settings require it, or a signal stops it."""
        try:
            while not self.is_over:
                watched = [fd for line in self.lines for fd in line.watched_files()]
                if commands is not None:
                    watched.append(commands)
                wait_s = min([line.wait_s() for line in self.lines])
                if self.surroundings is not None:
                    wait_s = min(wait_s, self.surroundings.wait_s())
                ready, _, _ = select.select(watched, (), (), wait_s)
                now_s = time.monotonic()
                if commands in ready and not self._take_commands(commands):
                    if self._settings.until_eof:
                        return
                    commands = None
                for line in self.lines:
                    line.serve(ready, now_s)
                if self.surroundings is not None:
                    self.surroundings.serve(any([line.heard for line in self.lines]))
        finally:
            self.close()

    # --- commands

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
        """Run a command: on its bus, on the bus without a name, or in the surroundings."""
        if self.surroundings is not None and text.split()[0] in self.surroundings.commands:
            return self.surroundings.obey(text)
        named = {line.settings.name or "": line for line in self.lines}
        for name, line in named.items():
            if text.startswith(f"{name}:"):
                return line.obey(text[len(name) + 1 :].strip())
        first, last = next(iter(named)), next(reversed(named))
        if "" not in named and len(named) > 1:
            names = ", ".join(named)
            return json.dumps({"error": f"name the bus first ({names}): {first}: {text}"})
        answer = named.get("", named[first]).obey(text)
        if text == "help" and len(named) > 1:
            hint = f"buses: {', '.join(filter(None, named))}; a command for one: {last}: {text}"
            answer = json.dumps({"ok": f"{json.loads(answer)['ok']}\n{hint}"})
        return answer


@contextmanager
def _exit_with_client(until_eof: bool) -> Iterator[None]:
    """End this process with its client even while surroundings are created, which takes seconds."""
    made = threading.Event()
    number: int | None = None
    if until_eof and sys.stdin is not None:
        with suppress(OSError, ValueError):  # a program may have replaced it
            number = sys.stdin.fileno()

    def watch() -> None:
        client = select.poll()
        assert number is not None
        client.register(number, 0)  # a hang-up is always reported
        while not made.is_set():
            if client.poll(_LOOK_MS):
                os._exit(0)

    if number is not None:
        threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    finally:
        made.set()


def _warn(text: str) -> None:
    sys.stderr.write(text + "\n")


def run(settings: ServerSettings, say: Callable[[str], None], heed_ctrl_c: bool) -> None:
    """Serve until SIGTERM, Ctrl-C (if ``heed_ctrl_c``), or the end of standard input.

    Raises:
        ValueError, OSError: the settings are invalid.
    """
    servers: list[Server] = []

    def stop(number: int, frame: FrameType | None) -> None:
        for server in servers:
            server.is_over = True
        raise ServerStopped

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop if heed_ctrl_c else signal.SIG_IGN)
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    try:
        try:
            server = Server(settings, say)
        except SetupError as error:
            say(json.dumps({"error": str(error)}))
            return
        servers.append(server)
        if server.surroundings is not None:
            say(json.dumps({"joints": server.surroundings.joints()}))
        for line in server.lines:
            say(line.address_json())
        server.serve(sys.stdin.fileno() if sys.stdin is not None else None)
    except (ServerStopped, BrokenPipeError):
        return


def say(line: str) -> None:
    """Write one line to standard output immediately."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def settings_of(settings: Mapping[str, Any]) -> ServerSettings:
    """Return the settings decoded from JSON.

    Raises:
        ValueError, TypeError: a device or one of its settings is unknown.
    """
    buses = [
        BusSettings(**{**bus, "device": device_of_data(bus["device"])}) for bus in settings["buses"]
    ]
    around = settings.get("surroundings")
    surroundings = None if around is None else SurroundingsSettings(**around)
    return ServerSettings(tuple(buses), settings.get("until_eof", False), surroundings)


def main() -> None:
    """Serve the buses of the settings on the command line."""
    request_slice(SHORT_S)  # servos do not wait for a browser
    run(settings_of(json.loads(sys.argv[1])), say, heed_ctrl_c=False)


if __name__ == "__main__":
    main()

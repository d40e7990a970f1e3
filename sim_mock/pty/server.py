"""Emulated servos and boards on pseudo-terminals, in a process of their own.

``python -m gazerig.sim_mock.pty.server '{"buses": [{"device": {"kind": "dynamixel", "servos":
[[1, "xl330-m077", 2048]]}}]}'`` prints one JSON line a bus with its terminal's path and
serves clients that come and go. It takes commands as lines on standard input and answers
each with one JSON line: {"ok": ...} or {"error": ...}. Where there are several buses, a
command begins with the name of its own: ``neck: lose 3``; without one it is for the bus
that has none. Imports nothing heavy, so that it is up within a tenth of a second.

A server in a thread of the client's own process would fight it for the interpreter lock.
"""

import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import FrameType
from typing import Any

from gazerig.sim_mock.devices import unpacked
from gazerig.sim_mock.pty.line import BusSettings, TerminalLine


@dataclass(frozen=True)
class ServerSettings:
    """Devices to emulate; until_eof: stop at the end of standard input."""

    buses: tuple[BusSettings, ...]
    until_eof: bool = False


class ServerStopped(Exception):
    """SIGTERM or Ctrl-C came."""


class Server:
    """Serves every bus on a terminal of its own until stopped."""

    def __init__(self, settings: ServerSettings, say: Callable[[str], None]) -> None:
        self._settings = settings
        self._say = say
        warn = None if settings.until_eof else _warn
        self.lines: list[TerminalLine] = []
        self._typed = b""
        self.over = False
        """To be set by a signal: an exception alone may be swallowed where it arises."""
        names = [bus.name for bus in settings.buses]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"every bus needs a name of its own; there is {names}")
        try:
            for bus in settings.buses:
                self.lines.append(TerminalLine(bus, time.monotonic, say, warn))
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
            while not self.over:
                watched = [fd for line in self.lines for fd in line.watched()]
                if commands is not None:
                    watched.append(commands)
                wait_s = min([line.wait_s() for line in self.lines])
                ready, _, _ = select.select(watched, (), (), wait_s)
                now_s = time.monotonic()
                if commands in ready and not self._take_commands(commands):
                    if self._settings.until_eof:
                        return
                    commands = None
                for line in self.lines:
                    line.serve(ready, now_s)
        finally:
            self.close()

    # --- commands

    def _take_commands(self, commands: int | None) -> bool:
        """Carry out received command lines; return False at the end of standard input."""
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
        """Carry out a command on the bus it names, or on the one without a name."""
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


def _warn(text: str) -> None:
    sys.stderr.write(text + "\n")


def run(settings: ServerSettings, say: Callable[[str], None], heed_ctrl_c: bool) -> None:
    """Serve until SIGTERM, Ctrl-C where it is heeded, or the end of standard input.

    Raises:
        ValueError, OSError: the settings cannot be met.
    """
    servers: list[Server] = []

    def stop(number: int, frame: FrameType | None) -> None:
        for server in servers:
            server.over = True
        raise ServerStopped

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop if heed_ctrl_c else signal.SIG_IGN)
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    try:
        server = Server(settings, say)
        servers.append(server)
        for line in server.lines:
            say(line.where())
        server.serve(sys.stdin.fileno() if sys.stdin is not None else None)
    except (ServerStopped, BrokenPipeError):
        return


def say(line: str) -> None:
    """Write one line to standard output at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def settings_of(settings: Mapping[str, Any]) -> ServerSettings:
    """Return the settings decoded from JSON.

    Raises:
        ValueError, TypeError: there is no such device, or it has no such setting.
    """
    buses = [BusSettings(**{**bus, "device": unpacked(bus["device"])}) for bus in settings["buses"]]
    return ServerSettings(tuple(buses), settings.get("until_eof", False))


def main() -> None:
    """Serve the buses of the settings on the command line."""
    run(settings_of(json.loads(sys.argv[1])), say, heed_ctrl_c=False)


if __name__ == "__main__":
    main()

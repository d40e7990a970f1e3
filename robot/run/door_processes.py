"""Doors of a running rig: each is a supervised process, which connects to the head like any other.

A door is the object of an entry point of the group ``gazerig.door``. It uses the public ``import
gazerig`` only, so nothing that a neighbour sends can delay the control loop.
"""

import shlex
import subprocess
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from subprocess import PIPE
from typing import NamedTuple, Protocol, cast

from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import DOOR, find
from gazerig.drivers.process import child_process

_MODULE = "gazerig.robot.run.door_main"
_FIRST_WAIT_S, _LONGEST_WAIT_S = 1.0, 60.0
_ENDS_S = 2.0
_MAX_LINE = 400


class RunnableDoor(Protocol):
    """The object of a door's entry point."""

    summary: str

    def run(
        self, head: int | str | None = None, address: str = "", bind: str = "",
        say: Callable[[str], None] = ..., ends_with_input: bool = False,
    ) -> None:  # fmt: skip
        """Run the door until it is ended; see ``gazerig.doors.door.Door.run``."""


class DoorEntry(NamedTuple):
    """An entry of the rig's key ``doors``: the words after ``gazerig door``.

    Attributes:
        name: Name of the door.
        address: Address of the neighbour, "" for the usual one.
        bind: HOST:PORT to listen on, "" for the usual one on this computer.
    """

    name: str
    address: str = ""
    bind: str = ""

    @classmethod
    def parse(cls, text: str) -> "DoorEntry":
        """Return the entry of a text: ``NAME [ADDRESS] [--bind HOST:PORT]``.

        Raises:
            SetupError: it is not one.
        """
        try:
            words = shlex.split(text)
        except ValueError:
            words = []
        bind = ""
        if "--bind" in words[:-1]:
            at = words.index("--bind")
            bind = words[at + 1]
            del words[at : at + 2]
        if not 1 <= len(words) <= 2 or any(word.startswith("-") for word in words):
            raise SetupError(f"door {text!r}: expected NAME [ADDRESS] [--bind HOST:PORT]")
        return cls(words[0], " ".join(words[1:]), bind)


def load_door(name: str) -> RunnableDoor:
    """Return the door of a name.

    Raises:
        PluginError: no package has it, or it cannot be imported; the message lists the doors.
    """
    found = find(DOOR, name)
    door = found.load()
    if not callable(getattr(door, "run", None)):
        raise PluginError(f"{found.label} is not a Door of gazerig.doors.door")
    return cast(RunnableDoor, door)


class DoorProcesses:
    """The processes of a rig's doors. One that ends is started again, after a growing wait.

    Args:
        entries: The rig's key ``doors``.
        pid: Process id of the head.
        say: Receives one line per message.
    """

    def __init__(self, entries: Iterable[str], pid: int, say: Callable[[str], None]) -> None:
        self._entries, self._pid, self._say = tuple(entries), pid, say
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self._running: list[subprocess.Popen[bytes]] = []
        self._threads: list[threading.Thread] = []

    def open(self) -> None:
        """Start all doors, without waiting."""
        for entry in self._entries:
            thread = threading.Thread(
                target=self._supervise, args=(entry,), name=f"door {entry}", daemon=True
            )
            self._threads.append(thread)
            thread.start()

    def close(self) -> None:
        """End all doors; a process that hangs is killed."""
        self._closing.set()
        with self._lock:
            running = tuple(self._running)
        for process in running:
            _close_input(process)
        for process in running:
            try:
                process.wait(_ENDS_S)
            except subprocess.TimeoutExpired:
                process.kill()
        for thread in self._threads:
            thread.join(_ENDS_S)

    def _supervise(self, entry: str) -> None:
        """Run a door, and again whenever it ends."""
        wait_s, label = _FIRST_WAIT_S, f"door {next(iter(entry.split()), '')}"
        while not self._closing.is_set():
            try:
                process = self._start(entry)
            except OSError as error:
                self._say(f"{label}: {error}")
                return
            with process:
                assert process.stderr is not None
                for line in process.stderr:
                    text = line[:_MAX_LINE].decode("utf-8", "replace").strip()
                    if text and not self._closing.is_set():
                        self._say(f"{label}: {text}")
                code = process.wait()
            with self._lock:
                self._running.remove(process)
            if self._closing.is_set():
                return
            self._say(
                f"{label}: ended with code {code}; the head continues, and the door is "
                f"started again in {wait_s:g} s"
            )
            self._closing.wait(wait_s)
            wait_s = min(2.0 * wait_s, _LONGEST_WAIT_S)

    def _start(self, entry: str) -> subprocess.Popen[bytes]:
        """Start a door.

        Raises:
            OSError: it cannot be started.
        """
        process = child_process.start(_MODULE, entry, str(self._pid), stdin=PIPE, stderr=PIPE)
        with self._lock:
            self._running.append(process)
            if self._closing.is_set():
                _close_input(process)
        return process


def _close_input(process: subprocess.Popen[bytes]) -> None:
    """Close a door's standard input, with which it ends."""
    assert process.stdin is not None
    with suppress(OSError):
        process.stdin.close()

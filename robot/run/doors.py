"""Doors of a running rig: each is a process, which connects to the head like any other program.

A door is the object of an entry point of the group ``gazerig.door``. It uses the public ``import
gazerig`` only, so nothing that a neighbour sends can delay the control loop.
"""

import argparse
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Protocol, cast

from gazerig.config.rig import DoorParams
from gazerig.drivers.plugins import DOOR, find
from gazerig.drivers.process import child_process
from gazerig.drivers.process.visible_text import visible
from gazerig.errors import Error

_ENDS_S = 2.0
_MAX_LINE = 400


class RunnableDoor(Protocol):
    """The object of a door's entry point; see ``gazerig.doors.door.Door``."""

    summary: str
    run: Callable[..., None]


def load_door(name: str) -> RunnableDoor:
    """Return the door of a name.

    Raises:
        PluginError: no package has it, or it cannot be imported; the message lists the doors.
    """
    return cast(RunnableDoor, find(DOOR, name).load())


class DoorProcesses:
    """The processes of a rig's doors; one that ends is reported.

    Args:
        doors: The rig's key ``doors``.
        pid: Process id of the head.
        say: Receives one line per message.
    """

    def __init__(
        self, doors: Mapping[str, DoorParams], pid: int, say: Callable[[str], None]
    ) -> None:
        self._doors, self._pid, self._say = doors, pid, say
        self._running: list[subprocess.Popen[bytes]] = []
        self._threads: list[threading.Thread] = []
        self._closing = False

    def open(self) -> None:
        """Start all doors, without waiting."""
        for name, door in self._doors.items():
            words = _words(name, door)
            pipe = subprocess.PIPE
            process = child_process.start(__name__, str(self._pid), *words, stdin=pipe, stderr=pipe)
            self._running.append(process)
            thread = threading.Thread(
                target=self._follow, args=(words, process), name=f"door {name}", daemon=True
            )
            self._threads.append(thread)
            thread.start()

    def close(self) -> None:
        """End all doors, which end with their input; a process that hangs is killed."""
        self._closing = True
        for process in self._running:
            assert process.stdin is not None
            with suppress(OSError):
                process.stdin.close()
        for process in self._running:
            try:
                process.wait(_ENDS_S)
            except subprocess.TimeoutExpired:
                process.kill()
        for thread in self._threads:
            thread.join(_ENDS_S)

    def _follow(self, words: Sequence[str], process: "subprocess.Popen[bytes]") -> None:
        """Report a door's lines, and its end."""
        label = f"door {words[0]}"
        with process:
            for line in process.stderr or ():
                text = line[:_MAX_LINE].decode("utf-8", "replace").strip()
                if text and not self._closing:
                    self._say(f"{label}: {text}")
            code = process.wait()
        if not self._closing:
            self._say(
                f"{label}: ended with code {code}; the head continues; start the door again with "
                f"gazerig door {' '.join(words)}"
            )


def _words(name: str, door: DoorParams) -> list[str]:
    """Return the words after ``gazerig door`` that start a door."""
    words = [name, door.address] if door.address else [name]
    if door.bind:
        words += "--bind", door.bind
    return [*words, "--addressed"] if door.addressed else words


def main() -> int:
    """Run a door until the rig's process ends; its command line: process id, then ``_words``."""

    def say(line: str) -> None:
        sys.stderr.write(f"{visible(line)}\n")
        sys.stderr.flush()

    parser = argparse.ArgumentParser(prog="door")
    parser.add_argument("pid", type=int)
    parser.add_argument("name")
    parser.add_argument("address", nargs="?", default="")
    parser.add_argument("--bind", default="")
    parser.add_argument("--addressed", action="store_true")
    entry = parser.parse_args()
    try:
        load_door(entry.name).run(
            entry.pid, entry.address, entry.bind, say,
            ends_with_input=True, addressed=entry.addressed,
        )  # fmt: skip
    except Error as error:
        say(str(error))
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

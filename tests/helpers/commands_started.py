"""Commands in processes of their own, heard while they run, and the servos that they reach."""

import json
import os
import pty
import select
import signal
import subprocess
import time
from collections.abc import Callable
from typing import IO

from branch import Branch, become, gazerig


def start(*words: str) -> subprocess.Popen[str]:
    """Start a command with pipes for all that it reads and writes."""
    pipe = subprocess.PIPE
    return Branch(gazerig(*words), stdin=pipe, stdout=pipe, stderr=pipe, text=True)


def hear(stream: IO[str] | None, wanted: str, within_s: float = 60.0) -> None:
    """Read until a text has come."""
    assert stream is not None
    end_s, seen = time.monotonic() + within_s, ""
    while wanted not in seen:
        assert select.select([stream], [], [], max(0.0, end_s - time.monotonic()))[0], seen
        data = os.read(stream.fileno(), 4096).decode()
        assert data, seen
        seen += data


def status(command: Callable[[str], str], servo_id: int) -> dict[str, object]:
    """Return what an emulated servo truly does."""
    found: dict[str, object] = next(
        servo for servo in json.loads(command("status"))["servos"] if servo["id"] == servo_id
    )
    return found


PATIENCE_S = 180.0
"""Longest wait for each thing that is to come, on a machine that does much else."""


class OnTerminal:
    """A command on a pseudo-terminal, and what it has written that was not waited for."""

    def __init__(self, *words: str) -> None:
        self.said = ""
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            become(gazerig(*words))

    def reads(self, words: str) -> None:
        """Wait for words that have not been waited for."""
        self.reads_one_of(words)

    def types(self, keys: bytes) -> None:
        os.write(self.fd, keys)

    def reads_one_of(self, *several: str) -> str:
        """Wait for the first of several that comes; return it."""
        end_s = time.monotonic() + PATIENCE_S
        while not (come := [words for words in several if words in self.said]):
            going = time.monotonic() < end_s and self._read()
            assert going, f"{several} does not come, only {self.said[-2000:]!r}"
        first = min(come, key=self.said.index)
        self.before, _, self.said = self.said.partition(first)
        return first

    def _read(self) -> bool:
        """Read its output; return False at its end."""
        if not select.select([self.fd], [], [], 0.2)[0]:
            return True
        try:
            data = os.read(self.fd, 4096)
        except OSError:  # Linux reports this when the other side has closed
            return False
        self.said += data.decode(errors="replace")
        return bool(data)

    def ends(self) -> int:
        """Wait for the end; give the exit code."""
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s and self._read():
            continue
        while not self._ended() and time.monotonic() < end_s:
            time.sleep(0.01)
        return self._reap()

    def _ended(self) -> bool:
        return os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None

    def _reap(self) -> int:
        if not self._ended():
            os.kill(self.pid, signal.SIGKILL)
        _, how = os.waitpid(self.pid, 0)
        os.close(self.fd)
        self.pid = 0
        return os.waitstatus_to_exitcode(how)

    def __enter__(self) -> "OnTerminal":
        return self

    def __exit__(self, *_: object) -> None:
        if self.pid:
            self._reap()

"""Commands in processes of their own, heard while they run, and the servos that they reach."""

import json
import os
import select
import subprocess
import time
from collections.abc import Callable
from typing import IO

from command_line import GAZERIG


def start(*words: str) -> subprocess.Popen[str]:
    """Start a command with pipes for all that it reads and writes."""
    pipe = subprocess.PIPE
    return subprocess.Popen([*GAZERIG, *words], stdin=pipe, stdout=pipe, stderr=pipe, text=True)


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

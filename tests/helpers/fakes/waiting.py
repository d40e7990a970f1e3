"""Waiting for another thread or process, and a port for it."""

import socket
import time
from collections.abc import Callable
from typing import TypeVar

PATIENCE_S = 180.0

T = TypeVar("T")


def wait_for(what: Callable[[], T], patience_s: float = PATIENCE_S) -> T:
    """Wait until something is true, however busy the machine is; return it."""
    end_s = time.monotonic() + patience_s
    while not (found := what()):
        assert time.monotonic() < end_s, "it never came"
        time.sleep(0.002)
    return found


def eventually(check: Callable[[], object]) -> bool:
    """Wait for a condition; return False if it does not become true."""
    end_s = time.monotonic() + 20.0
    while time.monotonic() < end_s:
        if check():
            return True
        time.sleep(0.02)
    return False


def free_port() -> int:
    with socket.socket() as trial:
        trial.bind(("127.0.0.1", 0))
        return int(trial.getsockname()[1])

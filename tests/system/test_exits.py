"""Whatever ends a program that holds heads: no servo keeps its torque."""

import faulthandler
import subprocess
import sys
from typing import Any

import pytest
from attack.exits import POOLS, case
from branch import Branch

RATE_HZ = 50.0
"""Of the loops: no exit depends on it, and a quarter of the work is enough."""


def begin(code: str, words: list[str], **options: Any) -> "subprocess.Popen[bytes]":
    """Start a program in a branch of this process."""

    def work() -> None:
        faulthandler.disable()  # pytest's, of which a program knows nothing
        sys.argv = ["-c", *words]
        exec(code, {"__name__": "__main__"})

    return Branch(work, **options)


@pytest.mark.parametrize(
    ("kind", "interface", "exit_"),
    [
        ("desk", "command", "SIGKILL"),
        ("desk", "python", "SIGTERM"),
        ("desk", "python", "SIGSEGV"),
        ("desk", "python", "all descriptors closed"),
        ("feetech", "python", "guardian suspended, then SIGKILL"),
        ("feetech", "python", "2x SIGINT, .3 s"),
        ("maker", "daemon thread", "the main thread ends"),
        ("desk", "to_thread", "SIGINT"),
        ("maker", "thread pool", "SIGINT"),
        ("maker", "thread pool, shut down", "SIGINT"),
        ("desk", "event loop", "SIGINT"),
        ("desk", "thread pool, left open", "SIGINT"),
        ("desk", "thread pool", "SIGTERM"),
        ("maker", "two heads", "SIGUSR1"),
    ],
)
def test_no_servo_keeps_its_torque(kind: str, interface: str, exit_: str):
    row = case(kind, interface, exit_, begin, RATE_HZ)
    assert row.void == "" and row.of > 0
    assert row.powered == 0
    if interface in POOLS:
        assert row.code is not None, "the program waits for its thread"

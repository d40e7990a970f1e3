"""A program in its own session is a job of the terminal all the same."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress

import pytest

ALONE = [sys.executable, "-m", "gazerig.drivers.process.own_session"]
PROGRAM = """
import os, signal, sys, time
def end(number, frame):
    print(signal.Signals(number).name, flush=True)
    sys.exit(7)
for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"):
    signal.signal(getattr(signal, name), end)
print(os.getpid(), os.getsid(0), flush=True)
while True:
    time.sleep(0.05)
"""


@pytest.fixture
def job() -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The process of the terminal's job, and the number of the program."""
    words = [*ALONE, sys.executable, "-c", PROGRAM]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        program, session = map(int, process.stdout.readline().split())
        try:
            assert program == session != process.pid
            yield process, program
        finally:
            with suppress(ProcessLookupError):
                os.kill(program, signal.SIGKILL)
            process.kill()


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"])
def test_a_signal_reaches_the_program_whose_code_is_returned(
    job: tuple[subprocess.Popen[str], int], name: str
) -> None:
    process, _ = job
    process.send_signal(getattr(signal, name))
    assert process.communicate(timeout=20.0)[0].strip() == name
    assert process.returncode == 7


def test_the_program_ends_in_order_if_the_job_is_killed(
    job: tuple[subprocess.Popen[str], int],
) -> None:
    process, _ = job
    process.kill()
    assert process.communicate(timeout=20.0)[0].strip() == "SIGTERM"

"""A program in its own session is a job of the terminal all the same."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress

import pytest
from shown_page import wait_for

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


def _state(pid: int) -> str:
    with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
        return file.read().rpartition(")")[2].split()[0]


def test_the_program_is_suspended_and_continued_with_the_job(
    job: tuple[subprocess.Popen[str], int],
) -> None:
    process, program = job
    process.send_signal(signal.SIGTSTP)
    wait_for(lambda: _state(program) == _state(process.pid) == "T", "both being suspended")
    process.send_signal(signal.SIGCONT)
    wait_for(lambda: "T" not in _state(program) + _state(process.pid), "both running")


def test_a_killed_program_gives_the_code_of_a_shell() -> None:
    code = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    assert subprocess.run([*ALONE, sys.executable, "-c", code], check=False).returncode == 137


def test_a_hang_up_that_is_ignored_stays_ignored() -> None:
    code = "import signal; print(signal.getsignal(signal.SIGHUP) == signal.SIG_IGN)"
    words = ["nohup", *ALONE, sys.executable, "-c", code]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"

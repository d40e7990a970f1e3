"""Run a program in a session of its own, as a job of the terminal: the loop of ``make run``.

``python -m gazerig.drivers.process.own_session PROGRAM ARGUMENT...`` passes signals on and ends
with the program's exit code. Linux shares the processors among sessions (autogroup): in that of a
terminal, the loop would wait for everything else that was started there. Its own has a higher
priority where the system permits it.
"""

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from types import FrameType

from gazerig.drivers.process.priority import raise_priority

_PASSED_ON = {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP", "SIGCONT"}
_PR_SET_PDEATHSIG = 1


def parent_death_signal(number: signal.Signals) -> Callable[[], object]:
    """Return what makes a fork receive a signal when the thread that forked it ends."""
    prctl = ctypes.CDLL(None).prctl  # loaded before the fork
    return lambda: prctl(_PR_SET_PDEATHSIG, number)


def run(words: list[str]) -> int:
    """Run a program, and return its exit code as a shell does.

    The program is suspended with this process, and receives SIGTERM if this process is killed.

    Raises:
        OSError: it cannot be started.
    """
    numbers = {signal.Signals[name] for name in _PASSED_ON}
    if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:  # with nohup it outlives the terminal
        numbers.remove(signal.SIGHUP)
    end_with_parent = parent_death_signal(signal.SIGTERM)

    def prepare() -> None:
        end_with_parent()
        raise_priority()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)

    signal.pthread_sigmask(signal.SIG_BLOCK, numbers)  # until there is a program to pass them to
    program = subprocess.Popen(words, start_new_session=True, preexec_fn=prepare)

    def pass_on(number: int, frame: FrameType | None) -> None:
        program.send_signal(signal.SIGSTOP if number == signal.SIGTSTP else number)
        if number == signal.SIGTSTP:
            os.kill(os.getpid(), signal.SIGSTOP)

    for number in numbers:
        signal.signal(number, pass_on)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)
    code = program.wait()
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))

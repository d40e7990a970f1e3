"""Entry point of ``gazerig``: interrupts and standard files, before anything is loaded."""

import os
import signal
import sys
from types import FrameType


def main() -> None:
    """Run the command line."""
    # While modules are loaded, nothing needs to be shut down, and an exception raised there may be
    # lost or shown as a traceback.
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        signal.signal(signal.SIGINT, _exit_interrupted)
    hold_standard_files()
    try:
        from gazerig.robot.cli.main import main as run_command_line

        run_command_line()
    finally:  # all output is written: an interrupt has no effect any more
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _exit_interrupted(number: int, frame: FrameType | None) -> None:
    """Exit immediately, with the one-line message of Ctrl-C."""
    if sys.stderr is not None:
        os.write(2, b"interrupted\n")
    os._exit(130)


def hold_standard_files() -> None:
    """Open closed ones of standard input, output and error on the null device.

    Otherwise the next opened file gets such a number, and messages would be sent to the servos.
    """
    for fd in (0, 1, 2):
        try:
            os.fstat(fd)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
    nowhere = open(os.devnull, "r+", encoding="utf-8")  # noqa: SIM115 - for all of the program
    # Python sets a stream that was closed at the start to None, which libraries do not expect.
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, nowhere)

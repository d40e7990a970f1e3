"""Entry point of ``gazerig``; commands to a running rig do not load the rest of the program.

Loading all commands takes more than a second, which is too long for ``gazerig stop``.
"""

import os
import signal
import sys
from collections.abc import Mapping, Sequence
from types import FrameType

QUICK = frozenset(("ctl", "stop"))
"""The commands of gazerig.robot.cli.tune."""
_ELSEWHERE = {"--help", "--debug"}
"""Options that need the whole program."""


def main() -> None:
    """Run the command line."""
    # While modules are loaded, nothing needs to be shut down, and an exception raised there may be
    # lost or shown as a traceback.
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        signal.signal(signal.SIGINT, _exit_interrupted)
    hold_standard_files()
    try:
        if is_quick(sys.argv[1:], os.environ):
            from gazerig.robot.cli.terminal import run_app
            from gazerig.robot.cli.tune import app

            run_app(app, sys.argv[1:], "try with --debug")
        else:
            from gazerig.robot.cli.main import main as whole

            whole()
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


def is_quick(arguments: Sequence[str], environ: Mapping[str, str]) -> bool:
    """Return whether cli/tune.py alone can run the command, or complete it for a shell.

    arguments: arguments after ``gazerig``
    """
    if environ.get("_GAZERIG_COMPLETE", "").startswith("complete"):
        typed = environ.get("COMP_WORDS") or environ.get("_TYPER_COMPLETE_ARGS", "")
        begun = typed.split()[1:]
        # While the command's name is being typed, the completion needs the names of all commands.
        named = len(begun) > 1 or typed.endswith(" ")
        return named and begun[:1] != [] and begun[0] in QUICK
    return bool(arguments) and arguments[0] in QUICK and not _ELSEWHERE & set(arguments)

"""Where ``gazerig`` begins: the commands to a running rig do without the rest of the program.

Loading all commands takes more than a second; who types ``gazerig stop`` has none to lose.
"""

import os
import signal
import sys
from collections.abc import Mapping, Sequence
from types import FrameType

QUICK = frozenset(("ctl", "stop"))
"""The commands of gazerig.robot.cli.tune."""
_ELSEWHERE = {"--help", "--debug"}
"""Options that the whole program knows more about."""


def main() -> None:
    """Run the command line."""
    # While modules load nothing has been begun that would have to be ended, and an exception
    # raised among them may be lost or shown as a traceback.
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
    finally:  # all output is written: nothing is left to interrupt
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _exit_interrupted(number: int, frame: FrameType | None) -> None:
    """End at once, with the one line that Ctrl-C always gives."""
    if sys.stderr is not None:
        os.write(2, b"interrupted\n")
    os._exit(130)


def hold_standard_files() -> None:
    """Open what of standard input, output and error was closed: nothing goes there.

    Otherwise the next file that is opened gets its number, and messages go to the servos.
    """
    for fd in (0, 1, 2):
        try:
            os.fstat(fd)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free
    nowhere = open(os.devnull, "r+", encoding="utf-8")  # noqa: SIM115 - for all of the program
    # A stream that was closed when Python started is None there, which libraries do not expect.
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, nowhere)


def is_quick(arguments: Sequence[str], environ: Mapping[str, str]) -> bool:
    """Return whether cli/tune.py alone can do what was typed, or complete it for a shell.

    arguments: those after ``gazerig``
    """
    if environ.get("_GAZERIG_COMPLETE", "").startswith("complete"):
        typed = environ.get("COMP_WORDS") or environ.get("_TYPER_COMPLETE_ARGS", "")
        begun = typed.split()[1:]
        # While the command's own name is typed, the names of all others belong to it.
        named = len(begun) > 1 or typed.endswith(" ")
        return named and begun[:1] != [] and begun[0] in QUICK
    return bool(arguments) and arguments[0] in QUICK and not _ELSEWHERE & set(arguments)

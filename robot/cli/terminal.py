"""The terminal: lines for people, one status line, clear errors, and Ctrl-C as a wish to stop."""

import contextlib
import logging
import shutil
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from config.load import ConfigError, shipped_names
from drivers.errors import DriverError, SetupError

BAD_INPUT = 2
"""Exit code: something asked for or configured is wrong."""
FAULT = 1
"""Exit code: something failed while running."""

DEBUG_LOGGER = "gazerig"
"""At level DEBUG errors also show where they come from."""


def complete_rig(incomplete: str) -> list[str]:
    """Complete a rig: a shipped name, or a YAML file here."""
    here = sorted(str(path) for path in Path(".").glob("*.yaml"))
    return [name for name in (*shipped_names("rigs"), *here) if name.startswith(incomplete)]


RigArgument = Annotated[
    str,
    typer.Argument(
        metavar="RIG",
        help="A rig's YAML file, or the name of a shipped rig.",
        autocompletion=complete_rig,
    ),
]


@contextlib.contextmanager
def clear_errors() -> Iterator[None]:
    """Turn what a person can mend into its message and exit code 2."""
    try:
        yield
    except (ConfigError, SetupError) as error:
        _show_origin()
        print(error, file=sys.stderr)
        raise typer.Exit(BAD_INPUT) from None
    except DriverError as error:
        _show_origin()
        print(error, file=sys.stderr)
        raise typer.Exit(FAULT) from None
    except OSError as error:
        _show_origin()
        print(f"{error.filename or 'file'}: {error.strerror or error}", file=sys.stderr)
        raise typer.Exit(BAD_INPUT) from None


def _show_origin() -> None:
    """With --debug, show where the error at hand comes from."""
    if logging.getLogger(DEBUG_LOGGER).isEnabledFor(logging.DEBUG):
        traceback.print_exc()


@contextlib.contextmanager
def signals() -> Iterator[Callable[[], str | None]]:
    """Give whether Ctrl-C or SIGTERM came, by name; a second one is not waited for."""
    came: list[str] = []

    def note(number: int, _: FrameType | None) -> None:
        came.append(signal.Signals(number).name)
        if len(came) > 1:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: came[0] if came else None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def say(line: str) -> None:
    """Write a line for people; the status line before it is wiped."""
    wipe = "\r\x1b[K" if sys.stderr.isatty() else ""
    print(f"{wipe}{line}", file=sys.stderr, flush=True)


def status(line: str) -> None:
    """Rewrite the status line."""
    width = shutil.get_terminal_size().columns - 1
    print(f"\r\x1b[K{line[:width]}", end="", file=sys.stderr, flush=True)

"""The terminal: lines for people, one status line, clear errors, Ctrl-C as a request to stop."""

import atexit
import contextlib
import logging
import os
import shutil
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from gazerig.config.faults import ConfigError
from gazerig.config.shipped import shipped_names
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing, SetupError
from gazerig.robot.cli.line_writer import LineWriter
from gazerig.robot.cli.suggestions import completed, speaking_of, with_doctor
from gazerig.robot.control.interrupts import ENDING, Interrupts

BAD_INPUT = 2
"""Exit code: something asked for or configured is wrong."""
FAULT = 1
"""Exit code: something failed while running."""
INTERRUPTED = 130
"""Exit code: Ctrl-C before there was anything to park."""

DEBUG_LOGGER = "gazerig"
"""At level DEBUG errors also show where they come from."""

_STDERR = 2
_FLUSH_S = 1.0
"""The last lines have so long to be written."""
_UNREAD = "standard output: its reader has closed it"
_writer = LineWriter(_STDERR)
atexit.register(_writer.flush, _FLUSH_S)


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


ForceOption = Annotated[
    bool, typer.Option("--force", help="Write over files that are there already.")
]


@contextlib.contextmanager
def clear_errors(
    rig: str | None = None, port: str | None = None, mock: bool = False
) -> Iterator[None]:
    """Turn what a person can mend into its message and exit code 2.

    rig, port, mock: as the command was given them, for the commands that messages suggest
    """
    with speaking_of(rig, port, mock), _errors_said():
        yield


@contextlib.contextmanager
def _errors_said() -> Iterator[None]:
    try:
        yield
    except (ConfigError, SetupError) as error:
        _show_origin()
        say(with_doctor(str(error)) if isinstance(error, ServoMissing) else str(error))
        raise typer.Exit(BAD_INPUT) from None
    except DriverError as error:
        _show_origin()
        say(with_doctor(str(error)) if isinstance(error, ServoFault) else str(error))
        raise typer.Exit(FAULT) from None
    except BrokenPipeError:
        raise  # for run_app: standard output was closed
    except OSError as error:
        _show_origin()
        say(f"{error.filename or 'file'}: {error.strerror or error}")
        raise typer.Exit(BAD_INPUT) from None


def _show_origin() -> None:
    """With --debug, show the traceback of the current error."""
    if logging.getLogger(DEBUG_LOGGER).isEnabledFor(logging.DEBUG):
        say(traceback.format_exc().rstrip("\n"))


def run_app(app: Callable[[list[str]], object], arguments: list[str], again: str) -> NoReturn:
    """Run the command line and exit; whatever goes wrong is one line.

    Ctrl-C is "interrupted" and exit code 130, a reader of standard output that has gone one
    line and exit code 1.

    again: what to do about an unexpected error
    """
    threading.excepthook, before = _thread_failed, threading.excepthook
    code: str | int | None = None
    try:
        try:
            if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
                signal.signal(signal.SIGINT, signal.default_int_handler)
            app(arguments)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except SystemExit as end:
        code = end.code
        if code == INTERRUPTED:
            say("interrupted")
        elif isinstance(end.__context__, BrokenPipeError):  # typer exits without a word
            say(_UNREAD)
            _drop_stdout()
    except KeyboardInterrupt:
        say("interrupted")
        code = INTERRUPTED
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            say(f"standard output: {error.strerror or error}")
        else:
            say(_UNREAD)
        code = FAULT
        _drop_stdout()
    except Exception as error:
        if logging.getLogger(DEBUG_LOGGER).isEnabledFor(logging.DEBUG):
            say(traceback.format_exc().rstrip("\n"))
        what = " ".join(str(error).split()) or "no words"
        say(f"unexpected: {type(error).__name__}: {what}; {again}")
        code = FAULT
    finally:
        threading.excepthook = before
    sys.exit(code)


def _drop_stdout() -> None:
    """Discard what is still to be printed: at exit it would fail once more."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _thread_failed(args: threading.ExceptHookArgs) -> None:
    """Report in one line that a thread has ended by an error; the others go on."""
    name = args.thread.name if args.thread is not None else "a thread"
    what = " ".join(str(args.exc_value).split())
    say(f"{name} failed ({args.exc_type.__name__}: {what}); the rest runs on without")


def signals() -> Interrupts:
    """Return a block in which Ctrl-C and other requests to end are only noted, by name."""
    return Interrupts(also=_writer.unread)


@contextlib.contextmanager
def tidied_up() -> Iterator[None]:
    """Let a request to end that comes while a run is made end it as Ctrl-C does, files and all."""

    def end(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    here = threading.current_thread() is threading.main_thread()
    numbers = [one for one in ENDING if signal.getsignal(one) == signal.SIG_DFL] if here else []
    for number in numbers:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.SIG_DFL)


def say(line: str) -> None:
    """Write a line for people; the status line before it is wiped. Never waits, never raises."""
    _write(f"{completed(line)}\n", wiped=True)


def status(line: str) -> None:
    """Rewrite the status line. Never waits, never raises."""
    width = shutil.get_terminal_size().columns - 1
    _write(f"\r\x1b[K{line[:width]}", status=True)


def _write(text: str, wiped: bool = False, status: bool = False) -> None:
    """Write to standard error, in the writer's thread if that is a file, a pipe or a tty."""
    stderr = sys.stderr
    if stderr is None:  # it was closed before this program began
        return
    try:
        if wiped and stderr.isatty():
            text = f"\r\x1b[K{text}"
        if stderr.fileno() == _STDERR:
            (_writer.status if status else _writer.line)(text)
            return
    except (OSError, ValueError):  # it is no file at all
        pass
    with contextlib.suppress(OSError, ValueError):
        stderr.write(text)
        stderr.flush()

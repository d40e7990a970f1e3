"""Terminal: message lines, one status line, errors, Ctrl-C as a request to stop, and single keys.

A thread writes the message lines, so that a pipe without a reader, a terminal stopped with Ctrl-S
or a full disk delays no caller. Lines that cannot be written are dropped and counted.

In commands that messages suggest, RIG becomes the rig and port of the current command, which a
driver or the doctor does not have.
"""

import atexit
import contextlib
import logging
import os
import re
import select
import shlex
import shutil
import signal
import stat
import sys
import termios
import threading
import traceback
import tty
from collections.abc import Callable, Iterator
from typing import Annotated, Any, NoReturn, Self

import typer

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing, SetupError, extra_hint
from gazerig.drivers.process.visible_text import VisibleStream, visible
from gazerig.drivers.process.work_queue import WorkQueue
from gazerig.robot.loop.power_down import ENDING, Interrupts

_OF_REPORTS = ("jinja2", "scipy")
"""Packages of the extra ``report`` that commands import as soon as they start."""
_MOST = 500
"""Lines that may wait; further lines are dropped."""
_RETRY_S = 0.2
UNREAD = "standard error, whose reader has closed it"


class LineWriter:
    """Writes to a file descriptor, in the order of the calls.

    dropped: number of lines that were not written
    """

    def __init__(self, fd: int, most: int = _MOST) -> None:
        self._fd = fd
        self._most = most
        self._queue = WorkQueue("line writer")
        self.dropped = 0

    def line(self, text: str) -> None:
        """Write a line, including its line end, without waiting."""
        if len(self._queue) >= self._most:
            self.dropped += 1
        else:
            self._queue.add(lambda: self._write(text))

    def status(self, text: str) -> None:
        """Write a status line, unless other lines wait."""
        if not len(self._queue):
            self._queue.add(lambda: self._write(text))

    def lost_reader(self) -> str | None:
        """Return a message if the reader has closed the pipe, otherwise None."""
        poll = select.poll()
        poll.register(self._fd, 0)
        is_pipe = stat.S_ISFIFO(os.fstat(self._fd).st_mode)
        return UNREAD if is_pipe and any(e & select.POLLERR for _, e in poll.poll(0)) else None

    def flush(self, timeout_s: float) -> bool:
        """Wait until everything is written, at most this long; return whether it is."""
        return self._queue.wait_idle(timeout_s)

    def _write(self, text: str) -> None:
        data = text.encode(errors="replace")
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:  # another process has made it non-blocking
                with contextlib.suppress(OSError, ValueError):
                    select.select([], [self._fd], [], _RETRY_S)
            except OSError:  # no reader, or a full disk, which may have space again later
                self.dropped += 1
                return


_rig = "RIG"
"""Rig and port of the current command; shared by all threads, as all write messages."""


def complete_suggestions(text: str) -> str:
    """Return a message whose suggested commands use the rig and port of the current command."""
    return re.sub(r"\bRIG\b", lambda found: _rig, text)


BAD_INPUT = 2
"""Exit code: an argument or the configuration is invalid."""
FAULT = 1
"""Exit code: something failed while running."""
INTERRUPTED = 130
"""Exit code: Ctrl-C before anything had to be parked."""

DEBUG_LOGGER = "gazerig"
"""Logger; at level DEBUG errors are shown with their traceback."""

_STDERR = 2
_FLUSH_S = 1.0
"""Longest time to write the last lines at exit."""
_UNREAD = "standard output: its reader has closed it"
_writer = LineWriter(_STDERR)
atexit.register(_writer.flush, _FLUSH_S)


RigArgument = Annotated[
    str,
    typer.Argument(
        metavar="RIG",
        help="A rig's YAML file, or the name of a shipped rig.",
    ),
]


ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]


@contextlib.contextmanager
def clear_errors(
    rig: str | None = None, port: str | None = None, mock: bool = False
) -> Iterator[None]:
    """Convert errors that a user can correct to their message and exit code 2.

    rig, port, mock: arguments of the command, for suggested commands
    """
    global _rig
    outer = _rig
    if rig is not None:
        named = f" --port {shlex.quote(port)}" if port else ""
        _rig = f"{shlex.quote(rig)}{named}{' --mock' if mock else ''}"
    try:
        yield
    except (ConfigError, SetupError, DriverError) as error:
        text = str(error)
        is_servo = isinstance(error, ServoMissing | ServoFault)
        if is_servo and rig is not None and not mock and "gazerig " not in text:
            text = f"{text}; gazerig doctor RIG finds the cause"
        _exit(text, BAD_INPUT if isinstance(error, ConfigError | SetupError) else FAULT)
    except ModuleNotFoundError as error:
        if error.name not in _OF_REPORTS:
            raise
        _exit(extra_hint(error.name, "report", error), BAD_INPUT)
    except BrokenPipeError:
        raise  # for run_app: standard output was closed
    except OSError as error:
        _exit(f"{error.filename or 'file'}: {error.strerror or error}", BAD_INPUT)
    finally:
        _rig = outer


def _exit(text: str, code: int) -> NoReturn:
    """Print a message, with --debug after the traceback of the current error, and exit."""
    if logging.getLogger(DEBUG_LOGGER).isEnabledFor(logging.DEBUG):
        say(traceback.format_exc().rstrip("\n"))
    say(text)
    raise typer.Exit(code) from None


def run_app(app: Callable[[list[str]], object], arguments: list[str], again: str) -> NoReturn:
    """Run the command line and exit; report every error in one line.

    Ctrl-C prints "interrupted" and has exit code 130. If the reader of standard output has closed
    it, one line is printed and the exit code is 1.

    again: remedy for an unexpected error
    """
    threading.excepthook, before = _report_thread_error, threading.excepthook
    streams = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (None if s is None else VisibleStream(s) for s in streams)
    code: str | int | None = FAULT
    try:
        try:
            if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
                signal.signal(signal.SIGINT, signal.default_int_handler)
            app(arguments)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except (KeyboardInterrupt, SystemExit) as end:
        code = end.code if isinstance(end, SystemExit) else INTERRUPTED
        if code == INTERRUPTED:
            say("interrupted")
        elif isinstance(end.__context__, BrokenPipeError):  # typer exits without a message
            _drop_stdout(end.__context__)
    except OSError as error:
        _drop_stdout(error)
    except Exception as error:
        if logging.getLogger(DEBUG_LOGGER).isEnabledFor(logging.DEBUG):
            say(traceback.format_exc().rstrip("\n"))
        what = " ".join(str(error).split()) or "no words"
        say(f"unexpected: {type(error).__name__}: {what}; {again}")
    finally:
        threading.excepthook = before
        sys.stdout, sys.stderr = streams
    sys.exit(code)


def _drop_stdout(error: OSError) -> None:
    """Report lost output, and discard the rest, which would fail again at exit."""
    say(_UNREAD if isinstance(error, BrokenPipeError) else f"standard output: {error.strerror}")
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _report_thread_error(args: threading.ExceptHookArgs) -> None:
    """Report in one line that an error has ended a thread; the other threads continue."""
    name = args.thread.name if args.thread is not None else "a thread"
    what = " ".join(str(args.exc_value).split())
    say(f"{name} failed ({args.exc_type.__name__}: {what}); the program continues without it")


def record_signals() -> Interrupts:
    """Return a block that records Ctrl-C and other requests to end by name."""
    return Interrupts(also=_writer.lost_reader)


@contextlib.contextmanager
def exit_on_signals() -> Iterator[None]:
    """Exit on a request to end while a run is being prepared, with the same cleanup as Ctrl-C."""

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
    """Write a message line and clear the status line before it. Never waits, never raises."""
    _write(f"{visible(complete_suggestions(line))}\n", wiped=True)


def finish_lines() -> None:
    """Wait until the message lines are written, so that a prompt that follows is below them."""
    _writer.flush(_FLUSH_S)


def confirm(question: str, **options: Any) -> bool:
    """Ask a question with the answers yes or no below all message lines; as ``typer.confirm``."""
    finish_lines()
    return typer.confirm(question, **options)


def status(line: str) -> None:
    """Rewrite the status line. Never waits, never raises."""
    width = shutil.get_terminal_size().columns - 1
    _write(f"\r\x1b[K{visible(line)[:width]}", status=True)


def _write(text: str, wiped: bool = False, status: bool = False) -> None:
    """Write to standard error, in the writer's thread if that is a file, a pipe or a tty."""
    stderr = getattr(sys.stderr, "rich_proxied_file", sys.stderr)
    if stderr is None:  # closed before this program started
        return
    try:
        if wiped and stderr.isatty():
            text = f"\r\x1b[K{text}"
        if stderr.fileno() == _STDERR:
            (_writer.status if status else _writer.line)(text)
            return
    except (OSError, ValueError):  # it is not a file
        pass
    with contextlib.suppress(OSError, ValueError):
        stderr.write(text)
        stderr.flush()


# --- single keys

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
# Arrow keys in both modes of a terminal (ECMA-48 CSI, or SS3), other keys that send sequences, and
# single characters.
_KEY = re.compile(r"\x1b(?:\[[0-9;?]*|O)(?P<code>[A-Za-z~])|(?P<typed>.)", re.DOTALL)
_BEGUN = re.compile(r"\x1b(?:\[[0-9;?]*|O)?$")


def split_keys(text: str) -> tuple[list[str], str]:
    """Return the typed keys one by one, and the start of an incomplete sequence.

    A letter is returned unchanged, an arrow key as "up", "down", "left" or "right". Other keys that
    send sequences are omitted.
    """
    begun = _BEGUN.search(text)
    end = begun.start() if begun is not None else len(text)
    keys = (found["typed"] or _ARROWS.get(found["code"]) for found in _KEY.finditer(text[:end]))
    return [key for key in keys if key is not None], text[end:]


class TerminalInput:
    """Standard input without line buffering and echo; Ctrl-C remains a signal; restored on exit."""

    def __enter__(self) -> Self:
        """Switch line buffering and echo off."""
        self._before = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin, termios.TCSANOW)
        return self

    def __exit__(self, *raised: object) -> None:
        """Switch them on again; unread keys are discarded."""
        # Not TCSAFLUSH, which would wait for a terminal that was stopped with Ctrl-S.
        with contextlib.suppress(termios.error, OSError):  # it may not exist any more
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
            termios.tcsetattr(sys.stdin, termios.TCSANOW, self._before)

    def text(self) -> str | None:
        """Return the typed text, "" for none, None if the terminal does not exist any more."""
        if not select.select([sys.stdin.fileno()], [], [], 0.0)[0]:
            return ""
        try:
            data = os.read(sys.stdin.fileno(), 256)
        except OSError:
            data = b""
        return data.decode(errors="replace") if data else None

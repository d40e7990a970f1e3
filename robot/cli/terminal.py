"""Terminal output: message lines, one status line, errors, and Ctrl-C as a request to stop.

A thread writes the message lines, so that a pipe without a reader, a terminal stopped with Ctrl-S
or a full disk delays no caller. Lines that cannot be written are dropped and counted.

Commands suggested in messages get the rig and port of the current command. A driver or the doctor
that reports a fault does not have them; without them a suggested command would use the default rig.
"""

import atexit
import contextlib
import errno
import logging
import os
import re
import select
import shlex
import shutil
import signal
import stat
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any, NoReturn

import typer

from gazerig.config.faults import ConfigError
from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing, SetupError, extra_hint
from gazerig.drivers.process.visible_text import VisibleStream, visible
from gazerig.drivers.process.work_queue import WorkQueue
from gazerig.robot.loop.power_down import ENDING, Interrupts

_OF_REPORTS = ("jinja2", "scipy")
"""Packages of the extra ``report`` that commands import as soon as they start."""
_MOST = 500
"""Lines that may wait; further lines are dropped."""
_RETRY_S = 0.2
_LOOK_S = 0.5
UNREAD = "standard error, whose reader has closed it"
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors that may end: a disk may have space again later."""


class LineWriter:
    """Writes to a file descriptor, in the order of the calls.

    dropped: number of lines that were not written
    """

    def __init__(self, fd: int, most: int = _MOST) -> None:
        self._fd = fd
        self._most = most
        self._queue = WorkQueue("line writer")
        self._status: str | None = None
        self._status_waits = False
        self._gone = False
        self._unread: str | None = None
        self._look_s = 0.0
        self.dropped = 0

    def line(self, text: str) -> None:
        """Write a line, including its line end, without waiting."""
        if self._gone or len(self._queue) >= self._most:
            self.dropped += 1
            return
        # The text of the status line is older than this line.
        self._status = None
        self._queue.add(lambda: self._write(text))

    def status(self, text: str) -> None:
        """Write a status line, unless a newer text replaces it first; does not wait."""
        if self._gone:
            return
        self._status = text
        if not self._status_waits:
            self._status_waits = True
            self._queue.add(self._write_status)

    def lost_reader(self) -> str | None:
        """Return a message if the reader has closed the pipe, otherwise None."""
        now_s = perf_counter()
        if self._unread is None and now_s - self._look_s > _LOOK_S:
            self._look_s = now_s
            if self._reader_gone():
                self._unread = UNREAD
        return self._unread

    def flush(self, timeout_s: float) -> bool:
        """Wait until everything is written, at most this long; return whether it is."""
        return self._gone or self._queue.wait_idle(timeout_s)

    def _reader_gone(self) -> bool:
        """Return whether a pipe has lost its reader, which only the next write would detect."""
        try:
            if not stat.S_ISFIFO(os.fstat(self._fd).st_mode):
                return False
            poll = select.poll()
            poll.register(self._fd, 0)
            return any(events & select.POLLERR for _, events in poll.poll(0))
        except OSError:
            return False

    def _write_status(self) -> None:
        self._status_waits = False
        text, self._status = self._status, None
        if text is not None:
            self._write(text)

    def _write(self, text: str) -> None:
        data = text.encode(errors="replace")
        while data and not self._gone:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:  # another process has made it non-blocking
                with contextlib.suppress(OSError, ValueError):
                    select.select([], [self._fd], [], _RETRY_S)
            except OSError as error:
                # Without a reader, all further lines are lost. SIGHUP reports a closed terminal.
                self._gone = error.errno not in _FULL
                if error.errno == errno.EPIPE:
                    self._unread = UNREAD
                break
        self.dropped += bool(data)


_SUGGESTED = re.compile(
    r"\bgazerig (?P<command>doctor|setup|calibrate|scan|run(?= --recover))\b"
    r"(?P<words>(?: --fix\b| --recover\b| --joint \w+| --kind \w+)*)"
)
_given: list[Mapping[str, object]] = [{}]
"""Parameters of the current command (last item). Shared by all threads, as monitor threads also
write messages.
"""


@contextlib.contextmanager
def suggest_for_rig(rig: str | None, port: str | None, mock: bool) -> Iterator[None]:
    """Make messages within the block suggest commands for this rig and port.

    A block without a rig uses the parameters of the enclosing block.
    """
    _given.append({"rig": rig, "port": port, "mock": mock} if rig is not None else _given[-1])
    try:
        yield
    finally:
        _given.pop()


def suggest_doctor(text: str) -> str:
    """Return a servo fault with the command that finds its cause, unless one is suggested."""
    given = _given[-1]
    reaches = isinstance(given.get("rig"), str) and given.get("mock") is not True
    return f"{text}; gazerig doctor finds the cause" if reaches and "gazerig " not in text else text


def complete_suggestions(text: str) -> str:
    """Return a message whose suggested commands use the rig and port of the current command."""
    known = _given[-1]
    if "gazerig " not in text or not isinstance(known.get("rig"), str):
        return text

    def whole(found: re.Match[str]) -> str:
        if text[found.end() :].startswith((f" {shlex.quote(str(known['rig']))}", " --port ")):
            return found[0]  # it already has these arguments
        port, mock = known.get("port"), known.get("mock") is True
        more = f" --port {shlex.quote(str(port))}" if isinstance(port, str) else ""
        more += " --mock" if mock else ""
        scans = found["command"] == "scan" and not mock
        named = "" if scans else f" {shlex.quote(str(known['rig']))}"
        return f"gazerig {found['command']}{named}{found['words']}{more}"

    return _SUGGESTED.sub(whole, text)


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


ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]


@contextlib.contextmanager
def clear_errors(
    rig: str | None = None, port: str | None = None, mock: bool = False
) -> Iterator[None]:
    """Convert errors that a user can correct to their message and exit code 2.

    rig, port, mock: arguments of the command, for suggested commands
    """
    with suggest_for_rig(rig, port, mock), _report_errors():
        yield


@contextlib.contextmanager
def _report_errors() -> Iterator[None]:
    try:
        yield
    except (ConfigError, SetupError) as error:
        _show_origin()
        say(suggest_doctor(str(error)) if isinstance(error, ServoMissing) else str(error))
        raise typer.Exit(BAD_INPUT) from None
    except DriverError as error:
        _show_origin()
        say(suggest_doctor(str(error)) if isinstance(error, ServoFault) else str(error))
        raise typer.Exit(FAULT) from None
    except ModuleNotFoundError as error:
        if error.name not in _OF_REPORTS:
            raise
        _show_origin()
        say(extra_hint(error.name, "report", error))
        raise typer.Exit(BAD_INPUT) from None
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
    """Run the command line and exit; report every error in one line.

    Ctrl-C prints "interrupted" and has exit code 130. If the reader of standard output has closed
    it, one line is printed and the exit code is 1.

    again: remedy for an unexpected error
    """
    threading.excepthook, before = _report_thread_error, threading.excepthook
    streams = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (None if s is None else VisibleStream(s) for s in streams)
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
        elif isinstance(end.__context__, BrokenPipeError):  # typer exits without a message
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
        sys.stdout, sys.stderr = streams
    sys.exit(code)


def _drop_stdout() -> None:
    """Discard unprinted output, which would fail again at exit."""
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

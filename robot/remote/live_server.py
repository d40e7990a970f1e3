"""Inputs of a running rig except the page: requests of programs, and edits of its files.

A rig that is being calibrated accepts only stops: ``StopOnlyServer``.
"""

import contextlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Protocol

from gazerig.drivers.errors import SetupError
from gazerig.robot.control.command_handler import Commandable, ParamAccess
from gazerig.robot.control.gesture_choices import GestureInfo
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Command, Resume, Stop
from gazerig.robot.model.reply import CommandTaker, Ticket
from gazerig.robot.model.types import LoopFigures
from gazerig.robot.remote.file_watch import FileWatch
from gazerig.robot.remote.request_handler import Pulse, RequestHandler
from gazerig.robot.remote.socket_server import RemoteServer


class FileTuning(ParamAccess, Protocol):
    """Parameters of a running rig, and the files that define them."""

    def files(self) -> Iterable[Path]:
        """Return the files in use: the rig's file and its overlays."""
        ...

    def reload(self, path: Path) -> object:
        """Apply the contents of a file; on errors change nothing and raise with all of them."""
        ...


class LiveServer:
    """Remote control and file watch of one running rig.

    Args:
        robot: Executes commands.
        tuning: Parameters and their files.
        refusals: Exceptions that ``tuning`` raises if a value breaks a rule.
        clock: Clock of the loop.
        about: Constant fields of the status, as {"rig": name, "pid": process}.
        say: Prints a line on the terminal.
        timing: Returns the timing statistics of the loop.
        fault: Executes a fault command of emulated servos; None if the servos are real.
    """

    def __init__(
        self,
        robot: Commandable,
        tuning: FileTuning,
        refusals: tuple[type[Exception], ...],
        clock: Clock,
        about: Mapping[str, object],
        say: Callable[[str], None],
        timing: Callable[[], LoopFigures | None] = lambda: None,
        fault: Callable[[str], str] | None = None,
    ) -> None:
        self._tuning = tuning
        self._refusals: tuple[type[Exception], ...] = (OSError, ValueError, *refusals)
        self._say = say
        self._pulse = Pulse(clock, timing)
        self._in_use: tuple[int, tuple[Path, ...]] = (-1, ())
        self._watch = FileWatch(self._files, self._read_again)
        requests = RequestHandler(
            robot, tuning, self._pulse, about, refusals, self._watch.saved, fault=fault
        )
        self._server = RemoteServer(requests, say)

    def open(self) -> None:
        """Listen to other programs and watch the files; print a line if listening fails."""
        try:
            self._server.open()
        except SetupError as error:  # the head runs without remote control
            self._say(f"gazerig ctl set and stop will not find this rig: {error}")
        self._watch.start()

    @property
    def update(self) -> Callable[[Tick], None]:
        """Return the function that stores the newest tick, for the loop."""
        return self._pulse.update

    def saved(self, path: Path) -> None:
        """Record that this program itself has written a file."""
        self._watch.saved(path)

    def close(self) -> None:
        """Close all connections and stop watching the files."""
        self._watch.stop()
        self._server.close()

    def _files(self) -> tuple[Path, ...]:
        """Return the files in use; if a new one cannot be found, the previous ones."""
        version, files = self._in_use
        now = self._tuning.version
        if now != version:
            with contextlib.suppress(*self._refusals):
                files = tuple(self._tuning.files())
            self._in_use = now, files
        return files

    def _read_again(self, path: Path) -> None:
        """Apply an edited file, or report all of its errors."""
        try:
            notes = self._tuning.reload(path)
        except self._refusals as error:
            self._say(f"{path} changed and is refused; the values from before stay:\n{error}")
            return
        lines = [str(note) for note in notes] if isinstance(notes, tuple | list) else []
        if lines:
            self._say("\n".join([f"{path} was edited: its values are applied", *lines]))
        else:
            self._say(f"{path} was written again without changes")


_FIXED = "it is being calibrated: its parameters stay as they are until that is over"


class StopOnlyServer:
    """Server that executes stop and resume, and refuses all other commands.

    Args:
        command: Queues a command for the next tick.
        clock: Clock of the loop.
        about: Constant fields of the status, as {"rig": name, "pid": process}.
        say: Prints a line on the terminal.
    """

    def __init__(
        self,
        command: CommandTaker,
        clock: Clock,
        about: Mapping[str, object],
        say: Callable[[str], None],
    ) -> None:
        self._say = say
        self._pulse = Pulse(clock)
        only = _OnlyStops(command)
        requests = RequestHandler(only, None, self._pulse, about, fixed=_FIXED)
        self._server = RemoteServer(requests, say)

    def open(self) -> None:
        """Listen to other programs; print a line if that fails."""
        try:
            self._server.open()
        except SetupError as error:  # the head goes on without
            self._say(f"gazerig stop will not find this rig: {error}")

    def update(self, tick: Tick) -> None:
        """Store the newest tick; called by the loop."""
        self._pulse.update(tick)

    def close(self) -> None:
        """Close all connections."""
        self._server.close()


class _OnlyStops:
    """Robot that executes only stop and resume."""

    def __init__(self, command: CommandTaker) -> None:
        self._command = command

    def command(self, command: Command) -> Ticket | None:
        """Queue a stop or resume.

        Raises:
            ValueError: it is another command.
        """
        if not isinstance(command, Stop | Resume):
            raise ValueError("it is being calibrated: only stop and resume are accepted")
        return self._command(command)

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return no menus."""
        return {}

    def gestures(self) -> tuple[GestureInfo, ...]:
        """Return no gestures."""
        return ()

"""Inputs of a running rig except the page: requests of programs, and edits of its files.

A rig that is being calibrated accepts only stops.

Files that users edit are watched. Editors overwrite a file, write it in two steps, rename a new
file over it, or delete it for a moment. New content is therefore accepted when two checks in a row
found the same, and a missing file when it is missing for several checks.
"""

import threading
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.robot.loop.loop import Robot
from gazerig.robot.model.clock import Clock
from gazerig.robot.net.request_handler import (
    REFUSALS,
    LoopMonitor,
    RequestHandler,
    accept_only_stops,
)
from gazerig.robot.net.socket_server import RemoteServer

if TYPE_CHECKING:
    from gazerig.config.rig_files import AllowedFolder
    from gazerig.robot.run.live import ParamStore
    from gazerig.robot.run.voice import RunVoice

EVERY_S = 0.5
_CALIBRATED = "it is being calibrated"
_LARGEST = 10_000_000  # bytes; no rig is as large, so more counts as missing
_LOOKS = 2
"""Checks in a row that must find the same content before it is read."""
_LOOKS_CUT = 6
"""Such checks of a missing file, or one without a final line end, which is probably not whole."""


def read_content(path: Path) -> bytes:
    """Return the content of a file, b"" if it cannot be read: absent, empty or not permitted."""
    try:
        return read_limited(path, _LARGEST)
    except OSError:
        return b""


class _Watched(NamedTuple):
    """A file: the content that was read, the content at the last check, and its checks in a row."""

    known: bytes
    last: bytes
    looks: int = 0


class FileWatch:
    """Thread that checks some files periodically.

    Args:
        files: Returns the files in use.
        changed: Called in this thread with a path of ``files`` that should be read again, also if
            the file is missing.
    """

    def __init__(
        self,
        files: Callable[[], Iterable[Path]],
        changed: Callable[[Path], None],
    ) -> None:
        self._files = files
        self._changed = changed
        self._lock = threading.Lock()
        self._watched: dict[Path, _Watched] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="file watch", daemon=True)

    def start(self) -> None:
        """Start watching; the present content of the files counts as read."""
        self.look()
        self._thread.start()

    def stop(self) -> None:
        """Stop watching."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def saved(self, path: Path) -> None:
        """Treat a file as known: it was written by this program; for any thread.

        A file that is not watched yet is watched from now on, so that an edit before the next check
        is noticed.
        """
        same = path.resolve()
        with self._lock:
            for known in [one for one in self._watched if one.resolve() == same] or [path]:
                content = read_content(known)
                self._watched[known] = _Watched(content, content)

    def look(self) -> None:
        """Check all files once and report those that are new or stay missing."""
        new = []
        with self._lock:
            before, self._watched = self._watched, {}
            for path in self._files():
                content = read_content(path)
                known, last, looks = before.get(path, _Watched(content, content))
                looks = looks + 1 if content == last else 1
                enough = _LOOKS if content.endswith(b"\n") else _LOOKS_CUT
                if content != known and looks >= enough:
                    known = content
                    new.append(path)
                self._watched[path] = _Watched(known, content, looks)
        # Not under the lock: the receiver may wait for a thread that saves.
        for path in new:
            self._changed(path)

    def _watch(self) -> None:
        while not self._over.wait(EVERY_S):
            self.look()


class LiveServer:
    """Remote control and file watch of one running rig.

    Args:
        robot: Executes commands.
        tuning: Parameters and their files; None: only stop and resume are accepted.
        clock: Clock of the loop.
        about: Constant fields of the status, e.g. {"rig": name, "pid": process}.
        say: Prints a line on the terminal.
        fault: Executes a fault command of emulated servos; None if the servos are real.
        changing: Returns the other fields of the status, e.g. {"page": address}.
        paths: Rules for the files that a client of the network may name; None if any.
        voice: Says sounds and texts; None if the head has no voice.

    Attributes:
        serve: Answers the page's process over a connection.
        update: Stores the newest tick, for the loop.
    """

    def __init__(
        self,
        robot: Robot,
        tuning: "ParamStore | None",
        clock: Clock,
        about: Mapping[str, object],
        say: Callable[[str], None],
        fault: Callable[[str], str] | None = None,
        changing: Callable[[], Mapping[str, object]] = dict,
        paths: "AllowedFolder | None" = None,
        voice: "RunVoice | None" = None,
    ) -> None:
        self._say, self._tuning = say, tuning
        pulse = LoopMonitor(clock)
        self._watch = FileWatch(tuning.files if tuning is not None else tuple, self._read_again)
        if tuning is None:
            only = accept_only_stops(robot.command, _CALIBRATED)
            fixed = f"{_CALIBRATED}: its parameters are fixed"
            handler = partial(RequestHandler, only, pulse, about, fixed=fixed)
        else:
            handler = partial(
                RequestHandler, robot.command, pulse, about, tuning, saved=self._watch.saved,
                voice=voice, menus=robot.menus, tracks=robot.tracks, fault=fault, changing=changing,
            )  # fmt: skip
        self._server = RemoteServer(handler(), say)
        # Apart from programs of this computer, so that neither uses up the other's time.
        self._page_server = RemoteServer(handler(paths=paths), say)
        self.serve, self.update = self._page_server.serve, pulse.update

    def open(self) -> None:
        """Listen to other programs and watch the files; print a line if listening fails."""
        try:
            self._server.open()
        except SetupError as error:  # the head runs without remote control
            self._say(f"gazerig ctl set and stop cannot find this rig: {error}")
        self._watch.start()

    def close(self) -> None:
        """Close all connections and stop watching the files."""
        self._watch.stop()
        self._page_server.close()
        self._server.close()

    def _read_again(self, path: Path) -> None:
        """Apply an edited file, or report all of its errors."""
        assert self._tuning is not None, "without parameters no file is watched"
        try:
            notes = self._tuning.reload(path)
        except REFUSALS as error:
            self._say(f"{path} changed but has errors; the previous values stay:\n{error}")
            return
        if notes:
            self._say("\n".join([f"{path} was edited: its values are applied", *notes]))
        else:
            self._say(f"{path} was written again without changes")

"""Socket of a running rig: its path, and JSON lines in both directions.

A Unix socket in a folder of the user: programs with access to the user's files may control the
head; other users and other computers may not.
"""

import contextlib
import os
import socket
import stat
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.robot.model.clock import RealClock

VERSION = 1
"""Version of requests and answers (docs/connect-your-program.md)."""
REQUEST_BYTES = 1 << 16
"""Longest request, bytes. Parsing 64 KiB occupies the interpreter for less than 1 ms."""
ANSWER_BYTES = 1 << 23
"""Longest answer that a client accepts, bytes."""
_PATH_BYTES = 107
"""Longest path of a Unix socket on Linux (unix(7), sun_path), without its ending zero."""
_CHUNK_BYTES = 1 << 16
_LONGEST_S = 1e6


def parse_line(line: bytes) -> Any:
    """Return the value of a line.

    Raises:
        MalformedMessage: it is not JSON.
    """
    try:
        return msgspec.json.decode(line)
    except RecursionError:
        raise MalformedMessage("nested too deeply", over=False) from None
    except ValueError as error:
        raise MalformedMessage(f"not a line of JSON: {error}", over=False) from None


class MalformedMessage(ValueError):
    """A message is not a line of JSON; the text names the reason.

    Attributes:
        over: Whether the end of the line is unknown, so that nothing after it can be read.
    """

    def __init__(self, message: str, over: bool) -> None:
        super().__init__(message)
        self.over = over


def socket_folder(environ: Mapping[str, str], uid: int) -> Path:
    """Return the folder of a user's sockets; it may not exist."""
    for runtime in (environ.get("XDG_RUNTIME_DIR"), f"/run/user/{uid}"):
        # unset, or left over from another user by sudo or su
        if runtime and os.path.isdir(runtime) and os.stat(runtime).st_uid == uid:
            return Path(runtime) / "gazerig"
    return Path(f"/tmp/gazerig-{uid}")


def make_private(path: Path, uid: int) -> None:
    """Create a folder that only its owner can enter, or check an existing one.

    Raises:
        SetupError: another user could put a socket there, or it cannot be created.
    """
    try:
        with contextlib.suppress(FileExistsError):
            path.mkdir(mode=0o700)
        private = is_private(path, uid)
    except OSError as error:
        raise SetupError(
            f"{path}: cannot be created ({error.strerror}); no remote control"
        ) from None
    if not private:
        raise SetupError(
            f"{path}: not a private folder of yours; remove it, or chmod 700 it if it is yours"
        )


def is_private(path: Path, uid: int) -> bool:
    """Return whether a path is a folder of this user, not a link, and closed to all others."""
    try:
        found = path.lstat()
    except FileNotFoundError:
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == uid and not found.st_mode & 0o077


def find_sockets(path: Path) -> dict[Path, int]:
    """Return path -> process id of the sockets in a folder, including dead ones."""
    found = path.glob("*.sock") if path.is_dir() else ()
    pids = {place: place.stem.partition("-")[0] for place in sorted(found)}
    return {place: int(pid) for place, pid in pids.items() if pid.isdecimal()}


def unused_path(path: Path, pid: int) -> Path:
    """Return an unused socket path of a process: 7.sock, for its second head 7-2.sock."""
    count, name = 1, path / f"{pid}.sock"
    while name.exists():
        count += 1
        name = path / f"{pid}-{count}.sock"
    return name


def connect_to_socket(path: Path, within_s: float) -> socket.socket:
    """Connect to a rig's socket.

    Raises:
        OSError: there is no answer; ConnectionRefusedError if the process is dead.
    """
    caller = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        caller.settimeout(within_s)
        caller.connect(str(path))
    except BaseException:
        caller.close()
        raise
    return caller


def listen(path: Path) -> socket.socket:
    """Listen on a socket file that only its owner may open; an existing one is replaced.

    Raises:
        SetupError: the path is too long, or the disk refuses.
    """
    # Renamed after it listens: a socket that refuses is taken for that of a dead rig.
    early = path.with_name(f"{path.name}.new")
    if len(os.fsencode(path)) > _PATH_BYTES - len(".new"):
        raise SetupError(f"{path}: too long for a socket; set XDG_RUNTIME_DIR to a shorter path")
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        early.unlink(missing_ok=True)
        listener.bind(str(early))
        early.chmod(0o600)
        listener.listen(128)
        early.rename(path)
    except OSError as error:
        listener.close()
        raise SetupError(
            f"{path}: no socket can be created there ({error.strerror}); no remote control"
        ) from None
    return listener


def shut(end: socket.socket) -> None:
    """Close a socket; a thread that waits on it gets an OSError or its end."""
    with contextlib.suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)
    end.close()


def peer_pid(end: socket.socket) -> int | None:
    """Return the process at the other end of a Unix socket, None if it is gone or another user's.

    The folder is closed to others; this is a second check.
    """
    try:
        data = end.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    except OSError:
        return None
    pid, uid, _ = struct.unpack("3i", data)
    return int(pid) if uid == os.getuid() else None


def remove_dead_sockets(path: Path) -> None:
    """Remove the sockets of killed rigs."""
    for place in find_sockets(path):
        try:
            connect_to_socket(place, 0.2).close()
        except ConnectionRefusedError:
            place.unlink(missing_ok=True)
        except OSError:  # busy, or removed meanwhile
            continue


class Wire:
    """One end of a connection; one thread may read while another one writes."""

    def __init__(self, end: socket.socket, longest: int) -> None:
        self._end = end
        self._writing_end = end.dup()  # with a timeout of its own
        self._longest = longest
        self._clock = RealClock()
        self._rest = b""

    def write(self, value: object, within_s: float) -> None:
        """Send one value.

        Raises:
            ValueError: it cannot be written as JSON.
            OSError: the other end is gone, or accepts nothing for ``within_s``.
        """
        line = msgspec.json.encode(value, enc_hook=_to_plain) + b"\n"
        self._writing_end.settimeout(within_s)
        self._writing_end.sendall(line)

    def read(self, first_s: float | None, rest_s: float) -> object:
        """Wait for one value: ``first_s`` for its start (None: 11 days), then ``rest_s``.

        Raises:
            EOFError: the other end has closed.
            TimeoutError: nothing came in ``first_s``.
            MalformedMessage: the message is not a line of JSON.
            OSError: the connection broke.
        """
        return parse_line(self.read_line(first_s, rest_s))

    @property
    def has_line(self) -> bool:
        """Return whether a line has been received that was not read yet."""
        return b"\n" in self._rest

    def drop_lines(self, find: Callable[[bytes], int]) -> int:
        """Drop the received lines before that in which ``find`` finds a place; return their number.

        Args:
            find: Returns a place in received data, -1 if there is none.
        """
        place = find(self._rest)
        end = self._rest.rfind(b"\n", 0, place if place >= 0 else len(self._rest)) + 1
        dropped, self._rest = self._rest[:end], self._rest[end:]
        return dropped.count(b"\n")

    def stop_reading(self) -> None:
        """Have readers of this end get its end; writers can go on."""
        with contextlib.suppress(OSError):  # the other end has closed
            self._end.shutdown(socket.SHUT_RD)

    def close(self) -> None:
        """Close the connection; readers at both ends get its end."""
        shut(self._end)
        self._writing_end.close()

    def read_line(self, first_s: float | None, rest_s: float) -> bytes:
        """Return one line without its end; arguments and exceptions are those of ``read``."""
        held = self._rest or self._receive(first_s)
        due_s = self._clock.now_s() + rest_s
        while b"\n" not in held:
            if len(held) > self._longest:
                raise MalformedMessage(f"longer than {self._longest} bytes", over=True)
            left_s = due_s - self._clock.now_s()
            try:
                if left_s <= 0.0:  # a sender of single bytes without a line end
                    raise TimeoutError
                held += self._receive(left_s)
            except TimeoutError:
                raise MalformedMessage(
                    f"no end of the line within {rest_s:g} s", over=True
                ) from None
        line, _, self._rest = held.partition(b"\n")
        if len(line) > self._longest:
            raise MalformedMessage(f"longer than {self._longest} bytes", over=True)
        return line

    def _receive(self, within_s: float | None) -> bytes:
        # Without a timeout it would block, and so would the writing end, which shares that state.
        self._end.settimeout(_LONGEST_S if within_s is None else within_s)
        data = self._end.recv(_CHUNK_BYTES)
        if not data:
            raise EOFError
        return data


def _to_plain(value: Any) -> Any:
    """Return a path as text, and a NumPy array or number as a list or a Python number."""
    return str(value) if isinstance(value, Path) else value.tolist()

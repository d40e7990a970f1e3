"""The socket of a running rig: where it is, and JSON lines through it, one each way.

A Unix socket in a folder of the user's own: who may open files of the user may steer the
head, no other user; nothing of it is seen from another machine. Where a system has no such
sockets, a port of the loopback takes its place: the file then holds the port and a token, which
a caller has to show first.
"""

import contextlib
import hmac
import json
import os
import secrets
import socket
import stat
import struct
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple, NoReturn, Self

from gazerig.drivers.errors import SetupError
from gazerig.robot.model.clock import RealClock

REQUEST_BYTES = 1 << 16
"""Longest request. Reading one holds the interpreter: 64 KiB take less than a millisecond."""
ANSWER_BYTES = 1 << 23
"""Longest answer a client takes."""
_PATH_BYTES = 107
"""Longest path of a Unix socket on Linux (unix(7), sun_path), without its ending zero."""
_CHUNK_BYTES = 1 << 16
HAS_SOCKET_FILES = hasattr(socket, "AF_UNIX") and hasattr(socket, "SO_PEERCRED")
"""Whether this system has sockets that are files, and tells who is at their other end: Linux."""
_LOOPBACK = "127.0.0.1"
_TOKEN_BYTES = 32
_TOKEN_S = 1.0


def user_id() -> int:
    """Return the number of the user who runs this program; 0 where users have none."""
    return os.getuid() if hasattr(os, "getuid") else 0


class MalformedMessage(ValueError):
    """What came is no JSON line; the message says why.

    over: the end of the line is not known, so that nothing after it can be read
    """

    def __init__(self, message: str, over: bool) -> None:
        super().__init__(message)
        self.over = over


def folder(environ: Mapping[str, str], uid: int) -> Path:
    """Return the folder of a user's sockets; it need not be there."""
    for runtime in (environ.get("XDG_RUNTIME_DIR"), f"/run/user/{uid}"):
        # unset, or left over from another user by sudo or su
        if runtime and os.path.isdir(runtime) and os.stat(runtime).st_uid == uid:
            return Path(runtime) / "gazerig"
    if not hasattr(os, "getuid"):  # Windows: what lies here is shut to other users
        return Path(environ.get("LOCALAPPDATA") or tempfile.gettempdir()) / "gazerig"
    return Path(f"/tmp/gazerig-{uid}")


def make_private(path: Path, uid: int) -> None:
    """Create a folder that only its owner can enter, or check that it is one.

    Raises:
        SetupError: another user could put a socket there, or it cannot be made.
    """
    try:
        with contextlib.suppress(FileExistsError):
            path.mkdir(mode=0o700)
        private = is_private(path, uid)
    except OSError as error:
        raise SetupError(f"{path}: cannot be made ({error.strerror}); no remote control") from None
    if not private:
        raise SetupError(
            f"{path}: not a folder of yours alone; remove it, or chmod 700 it if it is yours"
        )


def is_private(path: Path, uid: int) -> bool:
    """Return whether a path is a folder, no link, of this user and shut to all others."""
    try:
        found = path.lstat()
    except FileNotFoundError:
        return False
    if not hasattr(os, "getuid"):
        return stat.S_ISDIR(found.st_mode)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == uid and not found.st_mode & 0o077


def sockets(path: Path) -> dict[Path, int]:
    """Return the sockets in a folder, dead ones among them, and the process of each."""
    found = path.glob("*.sock") if path.is_dir() else ()
    pids = {place: place.stem.partition("-")[0] for place in sorted(found)}
    return {place: int(pid) for place, pid in pids.items() if pid.isdecimal()}


def free_name(path: Path, pid: int) -> Path:
    """Return a name for one more socket of a process: 7.sock, for its second head 7-2.sock."""
    count, name = 1, path / f"{pid}.sock"
    while name.exists():
        count += 1
        name = path / f"{pid}-{count}.sock"
    return name


def dial(path: Path, within_s: float) -> socket.socket:
    """Connect to a rig's socket.

    Raises:
        OSError: there is no answer; ConnectionRefusedError where the process is dead.
    """
    if not HAS_SOCKET_FILES:
        return _dial_port(path, within_s)
    caller = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        caller.settimeout(within_s)
        caller.connect(str(path))
    except BaseException:
        caller.close()
        raise
    return caller


def _dial_port(path: Path, within_s: float) -> socket.socket:
    """Connect to the port that a file names, and show the token.

    Raises:
        OSError: see ``dial``.
    """
    port, _, token = path.read_text(encoding="ascii").partition(" ")
    if not port.isdecimal():
        raise ConnectionRefusedError(f"{path} names no port")
    caller = socket.create_connection((_LOOPBACK, int(port)), within_s)
    try:
        caller.sendall(token.encode())
    except BaseException:
        caller.close()
        raise
    return caller


class Peer(NamedTuple):
    """Who is at the other end of a socket, as the kernel knows it; pid 0: it does not say."""

    pid: int
    uid: int


class Listener:
    """Takes callers of this user.

    token: what they must show, empty where the kernel tells who they are
    """

    def __init__(self, end: socket.socket, token: str = "") -> None:
        self._end = end
        self._token = token

    @property
    def waits_for_token(self) -> bool:
        """Return whether ``admitted`` waits for the caller to show a token."""
        return bool(self._token)

    def accept(self) -> socket.socket:
        """Wait for a caller, who is not yet known.

        Raises:
            OSError: it was closed.
        """
        return self._end.accept()[0]

    def admitted(self, caller: socket.socket) -> Peer | None:
        """Return who called, None for whoever may not.

        Raises:
            OSError: the caller is gone.
        """
        if not self._token:
            found = peer(caller)
            # The folder is shut to others; twice is safer.
            return found if found.uid == user_id() else None
        caller.settimeout(_TOKEN_S)
        shown = b""
        while len(shown) < _TOKEN_BYTES and (more := caller.recv(_TOKEN_BYTES - len(shown))):
            shown += more
        return Peer(0, user_id()) if hmac.compare_digest(shown, self._token.encode()) else None

    def __enter__(self) -> Self:
        """Listen within a block."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Close at its end."""
        self.close()

    def close(self) -> None:
        """Stop accepting callers; wakes who waits for one."""
        with contextlib.suppress(OSError):
            self._end.shutdown(socket.SHUT_RDWR)
        self._end.close()


def listen(path: Path) -> Listener:
    """Listen on a socket file, for its owner alone; an existing one is replaced.

    Raises:
        SetupError: the path is too long, or the disk refuses.
    """
    # Its name only once it listens: a socket that refuses is taken for a dead rig's.
    early = path.with_name(f"{path.name}.new")
    if not HAS_SOCKET_FILES:
        return _listen_on_port(path, early)
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
        raise SetupError(f"{path}: no socket there ({error.strerror}); no remote control") from None
    return Listener(listener)


def _listen_on_port(path: Path, early: Path) -> Listener:
    """Listen on a port of the loopback, and write it with a token into a file of this user."""
    listener = socket.socket()
    token = secrets.token_hex(_TOKEN_BYTES // 2)
    try:
        listener.bind((_LOOPBACK, 0))
        listener.listen(128)
        early.unlink(missing_ok=True)
        with open(os.open(early, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(f"{listener.getsockname()[1]} {token}")
        os.replace(early, path)
    except OSError as error:
        listener.close()
        raise SetupError(f"{path}: no port there ({error.strerror}); no remote control") from None
    return Listener(listener, token)


def peer(end: socket.socket) -> Peer:
    """Return who connected to a Unix socket.

    Raises:
        OSError: the connection is gone.
    """
    data = end.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    pid, uid, _ = struct.unpack("3i", data)
    return Peer(pid, uid)


def clear_dead(path: Path) -> tuple[int, ...]:
    """Remove the sockets that killed rigs left behind; give their processes' numbers."""
    dead: list[int] = []
    for place, pid in sockets(path).items():
        try:
            dial(place, 0.2).close()
        except ConnectionRefusedError:
            place.unlink(missing_ok=True)
            dead.append(pid)
        except OSError:  # busy or gone: not this program's concern
            continue
    return tuple(dead)


class Wire:
    """One end of a connection."""

    def __init__(self, end: socket.socket, longest: int) -> None:
        self._end = end
        self._longest = longest
        self._clock = RealClock()
        self._rest = b""

    def write(self, value: object, within_s: float) -> None:
        """Send one value.

        Raises:
            ValueError: it has no JSON, as infinity has none.
            OSError: the other end is gone, or takes nothing for ``within_s``.
        """
        line = json.dumps(value, allow_nan=False, separators=(",", ":")).encode() + b"\n"
        self._end.settimeout(within_s)
        self._end.sendall(line)

    def read(self, first_s: float | None, rest_s: float) -> object:
        """Wait for one value: ``first_s`` for its beginning (None: for ever), then ``rest_s``.

        Raises:
            EOFError: the other end has closed.
            TimeoutError: nothing came in ``first_s``.
            Garbled: what came is no line of JSON.
            OSError: the connection broke.
        """
        line = self._line(first_s, rest_s)
        try:
            return json.loads(line, parse_constant=_no_number)
        except RecursionError:
            raise MalformedMessage("nested too deep", over=False) from None
        except ValueError as error:
            raise MalformedMessage(f"not a line of JSON: {error}", over=False) from None

    def close(self) -> None:
        """Close this end; a reader at either end sees the end."""
        with contextlib.suppress(OSError):
            self._end.shutdown(socket.SHUT_RDWR)
        self._end.close()

    def _line(self, first_s: float | None, rest_s: float) -> bytes:
        """Return one line without its end."""
        held = self._rest or self._received(first_s)
        due_s = self._clock.now_s() + rest_s
        while b"\n" not in held:
            if len(held) > self._longest:
                raise MalformedMessage(f"longer than {self._longest} bytes", over=True)
            left_s = due_s - self._clock.now_s()
            try:
                if left_s <= 0.0:  # an end that never comes, byte by byte
                    raise TimeoutError
                held += self._received(left_s)
            except TimeoutError:
                raise MalformedMessage(
                    f"no end of the line within {rest_s:g} s", over=True
                ) from None
        line, _, self._rest = held.partition(b"\n")
        if len(line) > self._longest:
            raise MalformedMessage(f"longer than {self._longest} bytes", over=True)
        return line

    def _received(self, within_s: float | None) -> bytes:
        self._end.settimeout(within_s)
        data = self._end.recv(_CHUNK_BYTES)
        if not data:
            raise EOFError
        return data


def _no_number(word: str) -> NoReturn:
    """Refuse NaN and Infinity, which are no JSON."""
    raise ValueError(f"{word} is no number of JSON")

"""A pseudo-terminal in place of a serial adapter: Linux only.

The link to it keeps its name when the adapter is unplugged and plugged in again; the terminal
behind it gets a new number each time. The slave side stays open here, in raw mode; otherwise it
would echo and fail between two clients.
"""

import ctypes
import errno
import fcntl
import os
import pty
import struct
import termios
import tty
from pathlib import Path

# struct termios2 of asm-generic/termbits.h: 4 flag words, line, 19 control characters, 2 speeds
_TERMIOS2 = struct.Struct("<4I20s2I")
_TCGETS2, _TCSETS2 = 0x802C542A, 0x402C542B
_ANY_BAUD, _BAUD_MASK = 0o010000, 0o010017
_INPUT_SHIFT = 16

_OPEN, _CLOSE_WRITE, _CLOSE_NOWRITE = 0x20, 0x08, 0x10
_EVENT = struct.Struct("iIII")
"""Event of inotify(7), for which Python has no module."""


class ClientCounter:
    """Counts the clients that have a file open, with the kernel's inotify(7).

    If the kernel does not support it, ``fd`` is -1 and no client is counted.
    """

    def __init__(self, path: str) -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        self.fd = int(libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC))
        self.opened = 0
        if self.fd >= 0:
            wanted = _OPEN | _CLOSE_WRITE | _CLOSE_NOWRITE
            libc.inotify_add_watch(self.fd, path.encode(), wanted)

    def process_events(self) -> bool:
        """Process events; return True when the last client has closed the file."""
        before = self.opened
        gone = False
        try:
            data = os.read(self.fd, 4096)
        except BlockingIOError:
            return False
        at = 0
        while at < len(data):
            _, mask, _, name_length = _EVENT.unpack_from(data, at)
            at += _EVENT.size + name_length
            self.opened += 1 if mask & _OPEN else -1
            gone = gone or self.opened == 0
        self.opened = max(0, self.opened)
        return self.opened == 0 and (gone or before > 0)

    def close(self) -> None:
        """Stop watching."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1


class Terminal:
    """Master side of a pseudo-terminal.

    Args:
        link: a symbolic link to the terminal; an old link is replaced.
        baud: its speed until a client sets another.

    Raises:
        FileExistsError: another file has the name of the link.
        FileNotFoundError: its folder does not exist.
    """

    def __init__(self, link: Path | None = None, baud: int | None = None) -> None:
        self._link = link
        self._baud = baud
        self.master = self._slave = -1
        self.path = ""
        self.watch: ClientCounter | None = None
        self.plug()

    @property
    def is_plugged(self) -> bool:
        """Return whether the terminal exists."""
        return self.master >= 0

    def plug(self) -> None:
        """Create the terminal and its link."""
        self.master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self._slave)
        if self._baud is not None:
            words = list(
                _TERMIOS2.unpack(fcntl.ioctl(self._slave, _TCGETS2, bytes(_TERMIOS2.size)))
            )
            words[2] &= ~(_BAUD_MASK | _BAUD_MASK << _INPUT_SHIFT)
            words[2] |= _ANY_BAUD | _ANY_BAUD << _INPUT_SHIFT
            words[5] = words[6] = self._baud
            fcntl.ioctl(self._slave, _TCSETS2, _TERMIOS2.pack(*words))
        self.watch = ClientCounter(self.path)
        if self._link is not None:
            try:
                _create_link(self._link, self.path)
            except OSError:
                self._link = None
                self.unplug()
                raise
            self.path = str(self._link)

    def unplug(self) -> None:
        """Remove the link and the terminal: a client gets an I/O error or a hang-up."""
        if not self.is_plugged:
            return
        link, own = self._link, os.ttyname(self._slave)
        if link is not None and link.is_symlink() and os.readlink(link) == own:
            link.unlink()
        if self.watch is not None:
            self.watch.close()
        os.close(self._slave)
        os.close(self.master)
        self.master = self._slave = -1

    def read(self) -> bytes:
        """Return the bytes that the client has sent."""
        try:
            return os.read(self.master, 4096)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Send bytes to the client; bytes that a full terminal rejects are lost, as on a wire."""
        try:
            os.write(self.master, data)
        except BlockingIOError:
            return

    def client_baud(self) -> int:
        """Return the baud rate that the client has set."""
        words = fcntl.ioctl(self.master, _TCGETS2, bytes(_TERMIOS2.size))
        return int(_TERMIOS2.unpack(words)[-1])

    def hold(self, held: bool) -> None:
        """Stop or resume reading the client's bytes, as an adapter with a full buffer does."""
        termios.tcflow(self._slave, termios.TCOOFF if held else termios.TCOON)

    def forbid(self, forbidden: bool) -> None:
        """Forbid or allow opening; the superuser can open it in any case."""
        os.chmod(self._slave, 0 if forbidden else 0o620)

    def release(self) -> None:
        """Drop the last client's leftovers: unread answers, and the lock of a killed client."""
        termios.tcflush(self._slave, termios.TCIFLUSH)
        fcntl.ioctl(self._slave, termios.TIOCNXCL)


def _create_link(link: Path, target: str) -> None:
    """Create a link; a dangling link, or one to a terminal, is replaced."""
    if link.is_symlink():
        old = os.readlink(link)
        if not old.startswith("/dev/pts/") and os.path.exists(old):
            raise FileExistsError(errno.EEXIST, f"a link to {old} exists", str(link))
        link.unlink()
    elif link.exists():
        raise FileExistsError(errno.EEXIST, "another file has this name", str(link))
    try:
        link.symlink_to(target)
    except OSError as error:
        raise OSError(error.errno, os.strerror(error.errno or 0), str(link)) from None

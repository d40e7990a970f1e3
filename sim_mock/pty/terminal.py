"""A pseudo-terminal in place of a serial adapter: Linux only.

The link to it keeps its name when the adapter is unplugged and plugged in again; the terminal
behind it gets a new number each time. The slave side stays open here, in raw mode; otherwise it
would echo and fail between two clients.
"""

import ctypes
import fcntl
import os
import pty
import struct
import termios
import tty
from pathlib import Path

# struct termios2 of asm-generic/termbits.h: 4 flag words, line, 19 control characters, 2 speeds
_TERMIOS2, _TCGETS2 = struct.Struct("<4I20s2I"), 0x802C542A

_OPEN, _CLOSE_WRITE, _CLOSE_NOWRITE = 0x20, 0x08, 0x10
_EVENT = struct.Struct("iIII")
"""Event of inotify(7), for which Python has no module."""


class Terminal:
    """Master side of a pseudo-terminal.

    Args:
        link: a symbolic link to the terminal; a link to an old terminal is replaced.

    Attributes:
        path: the path to open.
        is_plugged: whether the terminal exists.

    Raises:
        FileExistsError: another file has the name of the link.
        FileNotFoundError: its folder does not exist.
    """

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
        self.plug()

    def plug(self) -> None:
        """Create the terminal and its link; ``clients`` becomes readable when one comes or goes."""
        self.master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        name = os.ttyname(self._slave)
        libc = ctypes.CDLL(None)
        self.clients = int(libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC))
        libc.inotify_add_watch(self.clients, name.encode(), _OPEN | _CLOSE_WRITE | _CLOSE_NOWRITE)
        self._opened = 0
        if self._link is not None:
            if self._link.is_symlink() and os.readlink(self._link).startswith("/dev/pts/"):
                self._link.unlink()
            self._link.symlink_to(name)
        self.path = str(self._link or name)
        self.is_plugged = True

    def unplug(self) -> None:
        """Remove the link and the terminal: a client gets an I/O error or a hang-up."""
        if not self.is_plugged:
            return
        self.is_plugged = False
        if self._link is not None:
            self._link.unlink(missing_ok=True)
        for fd in (self.clients, self._slave, self.master):
            os.close(fd)

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

    def count_clients(self) -> None:
        """Drop what the last client has left: unread answers, and the lock of a killed client."""
        for _, mask, _, _ in _EVENT.iter_unpack(os.read(self.clients, 4096)):
            self._opened = max(0, self._opened + (1 if mask & _OPEN else -1))
        if self._opened == 0:
            termios.tcflush(self._slave, termios.TCIFLUSH)
            fcntl.ioctl(self._slave, termios.TIOCNXCL)

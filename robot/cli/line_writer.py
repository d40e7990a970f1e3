"""Lines for people, written by a thread: a terminal that takes none delays no caller.

A pipe without a reader, a terminal stopped with Ctrl-S, a full disk, a terminal that was
closed: the caller continues immediately. Lines that cannot be written are dropped and counted.
"""

import contextlib
import errno
import os
import select
import stat
from time import perf_counter

from gazerig.drivers.process.bounded_call import BoundedCall

_MOST = 500
"""So many lines wait; more are dropped."""
_RETRY_S = 0.2
_LOOK_S = 0.5
UNREAD = "standard error, whose reader has closed it"
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""A disk may have room again."""


class LineWriter:
    """Writes to a file descriptor, in the order of the calls.

    dropped: lines that were not written
    """

    def __init__(self, fd: int, most: int = _MOST) -> None:
        self._fd = fd
        self._most = most
        self._call = BoundedCall("line writer", 0.0)
        self._status: str | None = None
        self._status_waits = False
        self._gone = False
        self._unread: str | None = None
        self._look_s = 0.0
        self.dropped = 0

    def line(self, text: str) -> None:
        """Write this, line end included; returns at once."""
        if self._gone or self._call.waiting() >= self._most:
            self.dropped += 1
            return
        # The text on the status line is older than this.
        self._status = None
        self._call.begin(lambda: self._write(text))

    def status(self, text: str) -> None:
        """Write this unless something newer comes first; returns at once."""
        if self._gone:
            return
        self._status = text
        if not self._status_waits:
            self._status_waits = True
            self._call.begin(self._write_status)

    def unread(self) -> str | None:
        """Return that its reader is gone, None while it may be there."""
        now_s = perf_counter()
        if self._unread is None and now_s - self._look_s > _LOOK_S:
            self._look_s = now_s
            if self._reader_gone():
                self._unread = UNREAD
        return self._unread

    def flush(self, timeout_s: float) -> bool:
        """Wait until everything is written, no longer than this; return whether it is."""
        return self._gone or self._call.idle(timeout_s)

    def _reader_gone(self) -> bool:
        """Return whether a pipe has lost its reader, which else only the next line would find."""
        try:
            if not hasattr(select, "poll"):  # Windows: the next line finds it
                return False
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
            except BlockingIOError:  # another process made it so
                with contextlib.suppress(OSError, ValueError):
                    select.select([], [self._fd], [], _RETRY_S)
            except OSError as error:
                # Without a reader, all that follow are lost. A terminal that is gone comes with
                # SIGHUP, for those who want to know.
                self._gone = error.errno not in _FULL
                if error.errno == errno.EPIPE:
                    self._unread = UNREAD
                break
        self.dropped += bool(data)

"""Lines for people, written by a thread: a terminal that takes none delays no caller.

A pipe without a reader, a terminal stopped with Ctrl-S, a full disk, a terminal that was
closed: the caller goes on at once. What cannot be written is dropped and counted.
"""

import contextlib
import errno
import os
import select
import stat
import threading
from collections import deque

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
        self._lines: deque[str] = deque()
        self._status: str | None = None
        self._busy = False
        self._gone = False
        self._unread: str | None = None
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self.dropped = 0

    def line(self, text: str) -> None:
        """Write this, line end included; returns at once."""
        with self._changed:
            if self._gone or len(self._lines) >= self._most:
                self.dropped += 1
                return
            # What was on the status line is older than this.
            self._status = None
            self._lines.append(text)
            self._wake()

    def status(self, text: str) -> None:
        """Write this unless something newer comes first; returns at once."""
        with self._changed:
            if not self._gone:
                self._status = text
                self._wake()

    def unread(self) -> str | None:
        """Return that its reader is gone, None while it may be there."""
        return self._unread

    def flush(self, timeout_s: float) -> bool:
        """Wait until everything is written, no longer than this; return whether it is."""
        with self._changed:
            return self._changed.wait_for(self._idle, timeout_s)

    def _idle(self) -> bool:
        return self._gone or not (self._lines or self._status is not None or self._busy)

    def _wake(self) -> None:
        if self._thread is None:
            thread = threading.Thread(target=self._work, name="line writer", daemon=True)
            try:
                thread.start()
            except RuntimeError:  # no memory for one: the next line tries again
                return
            self._thread = thread
        self._changed.notify_all()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                if not self._changed.wait_for(self._due, _LOOK_S):
                    if self._reader_gone():
                        self._unread = self._unread or UNREAD
                    continue
                if self._lines:
                    text = self._lines.popleft()
                else:
                    text, self._status = self._status or "", None
                self._busy = True
            self._write(text.encode(errors="replace"))

    def _due(self) -> bool:
        return bool(self._lines) or self._status is not None

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

    def _write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:  # another process made it so
                with contextlib.suppress(OSError, ValueError):
                    select.select([], [self._fd], [], _RETRY_S)
            except OSError as error:
                self._lose(error)
                return

    def _lose(self, error: OSError) -> None:
        """Drop a line; without a reader, all that follow."""
        with self._changed:
            self.dropped += 1
            if error.errno not in _FULL:
                self._gone = True
                # A terminal that is gone comes with SIGHUP, for those who want to know.
                if error.errno == errno.EPIPE:
                    self._unread = UNREAD
                self.dropped += len(self._lines)
                self._lines.clear()
                self._status = None

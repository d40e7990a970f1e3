"""Whether anybody has a terminal open: the kernel's inotify, of which Python has no module.

Constants and layout: inotify(7).
"""

import ctypes
import os
import struct

_OPEN, _CLOSE_WRITE, _CLOSE_NOWRITE = 0x20, 0x08, 0x10
_EVENT = struct.Struct("iIII")


class Watch:
    """Counts those who open and close a file, from now on.

    Where the kernel cannot, ``fd`` is -1 and nobody is ever seen.
    """

    def __init__(self, path: str) -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        self.fd = int(libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC))
        self.opened = 0
        if self.fd >= 0:
            wanted = _OPEN | _CLOSE_WRITE | _CLOSE_NOWRITE
            libc.inotify_add_watch(self.fd, path.encode(), wanted)

    def look(self) -> bool:
        """Take in what happened; True when the last one has gone."""
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
        """Stop looking."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1

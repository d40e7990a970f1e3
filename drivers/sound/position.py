"""Playback position in memory that the sound's process shares with the control loop.

    offset 0    uint64    sequence: odd while the record is written
    offset 8    uint64    number of the sound
    offset 16   float64   time at which its start is heard, monotonic s
    offset 24   float64   end of the sound that the device has received, s
    offset 32   uint64    whether a device is open

The position at a time is the time since the start is heard, at most the received end, so it stops
if the device or a stream stalls. Only the sound's process writes.
"""

import mmap
import os
from typing import NamedTuple

SIZE = 4096
_TRIES = 100


class PlayedSound(NamedTuple):
    """Record of the sound that is being played.

    Attributes:
        number: Number of the sound, 0 before the first.
        heard_s: Time at which its start is heard, monotonic s.
        received_s: End of the part that the device has received, s since its start.
    """

    number: int = 0
    heard_s: float = 0.0
    received_s: float = 0.0

    def position_s(self, now_s: float) -> float:
        """Return the position that is heard at a time, seconds since the sound's start."""
        return min(now_s - self.heard_s, self.received_s)


class PositionMemory:
    """View of the shared memory, in the program or in the sound's process.

    Args:
        fd: Descriptor of a file of ``SIZE`` bytes; it may be closed afterwards.
    """

    def __init__(self, fd: int) -> None:
        self._map = mmap.mmap(fd, SIZE)
        view = memoryview(self._map)
        self._counts, self._times = view[:16].cast("Q"), view[16:32].cast("d")
        self._open = view[32:40].cast("Q")

    @property
    def is_open(self) -> bool:
        """Return whether a device is open."""
        return bool(self._open[0])

    @is_open.setter
    def is_open(self, value: bool) -> None:
        self._open[0] = value

    def write(self, played: PlayedSound) -> None:
        """Write the record; only the sound's process may call it."""
        self._counts[0] += 1
        self._counts[1] = played.number
        self._times[0], self._times[1] = played.heard_s, played.received_s
        self._counts[0] += 1

    def read(self) -> PlayedSound | None:
        """Return the record; None if it is being written all the time."""
        for _ in range(_TRIES):
            before = self._counts[0]
            found = PlayedSound(self._counts[1], self._times[0], self._times[1])
            if before % 2 == 0 and self._counts[0] == before:
                return found
        return None


def shared_file() -> int:
    """Return the descriptor of a new file in memory, to be passed to another process."""
    fd = os.memfd_create("gazerig-sound", os.MFD_CLOEXEC)
    os.ftruncate(fd, SIZE)
    return fd

"""The newest encoded picture, from one process to another, through shared memory without a lock.

The writer fills the older of two entries and then counts it; the reader looks at the count before
and after, and leaves out what was overwritten meanwhile.
"""

import multiprocessing
from typing import NamedTuple

MOST_BYTES = 190_000
"""No picture is larger: 640 x 480 as a JPEG of good quality has a third of it."""


class Picture(NamedTuple):
    """An encoded picture: which one since the start, and when it came [s]."""

    number: int
    came_s: float
    data: bytes


class JpegSlot:
    """The newest picture.

    It can be handed to a process that is being started, as an argument.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._count = context.RawValue("q", 0)
        self._sizes = context.RawArray("q", 2)
        self._times = context.RawArray("d", 2)
        self._entries = context.RawArray("c", 2 * MOST_BYTES)

    def put(self, data: bytes, came_s: float) -> bool:
        """Leave a picture; only one thread writes. False where it is too large."""
        if not 0 < len(data) <= MOST_BYTES:
            return False
        count = self._count.value
        entry = count % 2
        start = entry * MOST_BYTES
        self._entries[start : start + len(data)] = data
        self._sizes[entry], self._times[entry] = len(data), came_s
        self._count.value = count + 1
        return True

    @property
    def came_s(self) -> float:
        """Return when the newest picture came, -inf before the first."""
        count = self._count.value
        return float(self._times[(count - 1) % 2]) if count else float("-inf")

    def newer(self, number: int) -> Picture | None:
        """Return the newest picture if its number is above this one, else None."""
        while (count := self._count.value) > number:
            entry = (count - 1) % 2
            start, size, came_s = entry * MOST_BYTES, self._sizes[entry], self._times[entry]
            data = bytes(self._entries[start : start + size])
            if self._count.value - count < 1:
                return Picture(count, came_s, data)
        return None

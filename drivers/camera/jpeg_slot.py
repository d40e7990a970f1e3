"""The newest encoded picture, passed from one process to another (``DoubleBuffer``)."""

from typing import NamedTuple

from gazerig.drivers.camera.double_buffer import CONTEXT, DoubleBuffer

MOST_BYTES = 190_000
"""Largest picture; a JPEG of 640 x 480 in good quality has a third of it."""


class Picture(NamedTuple):
    """An encoded picture: its number since the start, its time of arrival [s] and its bytes."""

    number: int
    came_s: float
    data: bytes


class JpegSlot:
    """Slot of the newest picture; it can be passed as an argument to a new process."""

    def __init__(self) -> None:
        self._newest = DoubleBuffer()
        self._sizes = CONTEXT.RawArray("q", 2)
        self._times = CONTEXT.RawArray("d", 2)
        self._entries = CONTEXT.RawArray("c", 2 * MOST_BYTES)

    def put(self, data: bytes, came_s: float) -> bool:
        """Store a picture; only one thread writes. Return False if it is too large."""
        if not 0 < len(data) <= MOST_BYTES:
            return False
        entry = self._newest.older
        start = entry * MOST_BYTES
        self._entries[start : start + len(data)] = data
        self._sizes[entry], self._times[entry] = len(data), came_s
        self._newest.filled()
        return True

    @property
    def came_s(self) -> float:
        """Return the time of arrival of the newest picture, -inf before the first."""
        count = self._newest.count
        return float(self._times[(count - 1) % 2]) if count else float("-inf")

    def newer(self, number: int) -> Picture | None:
        """Return the newest picture if its number is above this one, else None."""
        found = self._newest.read(self._copy, above=number)
        return None if found is None else Picture(found[0], *found[1])

    def _copy(self, entry: int) -> tuple[float, bytes]:
        start, size = entry * MOST_BYTES, self._sizes[entry]
        return self._times[entry], bytes(self._entries[start : start + size])

"""Values in shared memory without a lock, from one process to another.

The writer fills an entry and then increments the count; a reader copies an entry and reads the
count again. All can be passed as an argument to a new process.
"""

import multiprocessing
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_CONTEXT = multiprocessing.get_context("spawn")

MOST_BYTES = 190_000
"""Largest picture; a JPEG of 640 x 480 in good quality has a third of it."""


class Picture(NamedTuple):
    """An encoded picture: its number since the start, its time of arrival [s] and its bytes."""

    number: int
    came_s: float
    data: bytes


class JpegSlot:
    """Slot of the newest picture."""

    def __init__(self) -> None:
        self._count = _CONTEXT.RawValue("q", 0)
        self._sizes = _CONTEXT.RawArray("q", 2)
        self._times = _CONTEXT.RawArray("d", 2)
        self._entries = _CONTEXT.RawArray("c", 2 * MOST_BYTES)

    def put(self, data: bytes, came_s: float) -> bool:
        """Store a picture; only one thread writes. Return False if it is too large."""
        if not 0 < len(data) <= MOST_BYTES:
            return False
        entry = self._count.value % 2
        start = entry * MOST_BYTES
        self._entries[start : start + len(data)] = data
        self._sizes[entry], self._times[entry] = len(data), came_s
        self._count.value += 1
        return True

    @property
    def came_s(self) -> float:
        """Return the time of arrival of the newest picture, -inf before the first."""
        count = self._count.value
        return float(self._times[(count - 1) % 2]) if count else float("-inf")

    def newer(self, number: int) -> Picture | None:
        """Return the newest picture if its number is above this one, otherwise None."""
        while (count := self._count.value) > number:
            entry = (count - 1) % 2
            start, size = entry * MOST_BYTES, self._sizes[entry]
            data = bytes(self._entries[start : start + size])
            picture = Picture(count, float(self._times[entry]), data)
            if self._count.value == count:
                return picture
        return None


Floats = NDArray[np.float64]
Row = tuple[float, float, float]
_ENTRIES = 512  # 2.5 s at 200 Hz
_WIDTH = 10  # time, the rotation's nine numbers
_MARGIN = 8  # oldest entries that the writer may be overwriting
# A frame can be younger than the newest pose by a tick or two.
_NEWEST_SERVES_S = 0.05


class PoseBuffer:
    """Rotations of the camera over the last few seconds; one process writes."""

    def __init__(self) -> None:
        self._count = _CONTEXT.RawValue("q", 0)
        self._entries = _CONTEXT.RawArray("d", _ENTRIES * _WIDTH)

    def record(self, t_s: float, R: Sequence[Sequence[float]]) -> None:
        """Record an orientation (three rows); times must ascend."""
        x, y, z = R
        count = self._count.value
        start = count % _ENTRIES * _WIDTH
        self._entries[start : start + _WIDTH] = [t_s, *x, *y, *z]
        self._count.value = count + 1

    def rotation_at(self, t_s: float) -> Floats | None:
        """Return the rotation (3, 3) at a time; None if it is not stored."""
        # The complete entries in the order of time: (n, 10).
        before = int(self._count.value)
        entries = np.frombuffer(self._entries, np.float64).reshape(_ENTRIES, _WIDTH).copy()
        after = int(self._count.value)
        first = 0 if after <= _ENTRIES - _MARGIN else after - _ENTRIES + _MARGIN
        known = entries[np.arange(first, before) % _ENTRIES]
        if not len(known) or t_s < known[0, 0] or t_s > known[-1, 0] + _NEWEST_SERVES_S:
            return None
        mean = [np.interp(t_s, known[:, 0], column) for column in known[:, 1:].T]
        # Between two orientations one tick apart: the rotation nearest to the mean of the matrices.
        U, _, Vt = np.linalg.svd(np.reshape(mean, (3, 3)))
        return np.asarray(U @ Vt)

    def rotation_between(self, now_s: float, before_s: float) -> Floats | None:
        """Return R_now_before (3, 3), which turns directions in camera axes; None if unknown."""
        now, before = self.rotation_at(now_s), self.rotation_at(before_s)
        return None if now is None or before is None else np.asarray(now.T @ before)

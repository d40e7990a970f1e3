"""Double buffer in shared memory, from one process to another without a lock.

The writer fills the older entry and then increments the count. The reader reads the count before
and after, and reads again if the entry was overwritten meanwhile.
"""

import multiprocessing
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")

CONTEXT = multiprocessing.get_context("spawn")
"""Creates shared memory that can be passed to a new process."""


class DoubleBuffer:
    """Index of the newer of two entries; the user of this class owns their contents."""

    def __init__(self) -> None:
        self._count = CONTEXT.RawValue("q", 0)

    @property
    def count(self) -> int:
        """Return the number of entries written since the start."""
        return int(self._count.value)

    @property
    def older_index(self) -> int:
        """Return the index of the entry to fill next, 0 or 1."""
        return self.count % 2

    def mark_filled(self) -> None:
        """Mark the older entry as the newer; only one thread writes."""
        self._count.value += 1

    def read(self, copy: Callable[[int], T], above: int = 0) -> tuple[int, T] | None:
        """Return the number of the newest entry and its copy, None without one.

        Args:
            copy: Returns a copy of entry 0 or 1.
            above: Numbers up to this are known already.
        """
        while (count := self.count) > above:
            copied = copy((count - 1) % 2)
            if self.count == count:
                return count, copied
        return None


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
        entry = self._newest.older_index
        start = entry * MOST_BYTES
        self._entries[start : start + len(data)] = data
        self._sizes[entry], self._times[entry] = len(data), came_s
        self._newest.mark_filled()
        return True

    @property
    def came_s(self) -> float:
        """Return the time of arrival of the newest picture, -inf before the first."""
        count = self._newest.count
        return float(self._times[(count - 1) % 2]) if count else float("-inf")

    def newer(self, number: int) -> Picture | None:
        """Return the newest picture if its number is above this one, otherwise None."""
        found = self._newest.read(self._copy, above=number)
        return None if found is None else Picture(found[0], *found[1])

    def _copy(self, entry: int) -> tuple[float, bytes]:
        start, size = entry * MOST_BYTES, self._sizes[entry]
        return self._times[entry], bytes(self._entries[start : start + size])


_POSE_WIDTH = 13  # time, the rotation's nine numbers, the position

Row = tuple[float, float, float]


class TimedPose(NamedTuple):
    """Rotation (three rows) and position [m] of the head in the world at a time [s]."""

    t_s: float
    R_world_head: tuple[Row, Row, Row]
    p_world_head_m: Row


class PoseSlot:
    """Slot of the newest pose and the time of the first.

    It can be passed as an argument to a new process.
    """

    def __init__(self) -> None:
        self._newest = DoubleBuffer()
        self._first_s = CONTEXT.RawValue("d", 0.0)
        self._entries = CONTEXT.RawArray("d", 2 * _POSE_WIDTH)

    def record(
        self, t_s: float, R_world_head: Sequence[Sequence[float]], p_world_head_m: Sequence[float]
    ) -> None:
        """Record a pose; only one process writes."""
        if self._newest.count == 0:
            self._first_s.value = t_s
        x, y, z = R_world_head
        start = self._newest.older_index * _POSE_WIDTH
        self._entries[start : start + _POSE_WIDTH] = [t_s, *x, *y, *z, *p_world_head_m]
        self._newest.mark_filled()

    @property
    def first_s(self) -> float:
        """Return the time of the first pose, seconds; 0 before it."""
        return float(self._first_s.value)

    def newest(self) -> TimedPose | None:
        """Return the newest pose, None before the first."""
        found = self._newest.read(self._copy)
        if found is None:
            return None
        t_s, *v = found[1]
        rows = (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8])
        return TimedPose(t_s, rows, (v[9], v[10], v[11]))

    def _copy(self, entry: int) -> list[float]:
        start = entry * _POSE_WIDTH
        return list(self._entries[start : start + _POSE_WIDTH])


Floats = NDArray[np.float64]

_ENTRIES = 512  # 2.5 s at 200 Hz
_WIDTH = 10  # time, and the rotation's nine numbers
_MARGIN = 8  # oldest entries that the loop may be overwriting
# A frame can be younger than the newest pose by a tick or two.
_NEWEST_SERVES_S = 0.05


class PoseBuffer:
    """Orientations of the camera over the last few seconds.

    Motion detection needs the camera's own rotation between two frames. The ring is shared memory
    without a lock: the loop writes an entry and then increments the count. The reader reads the
    count before and after, and discards entries that may have been overwritten meanwhile.

    It can be passed as an argument to a new process.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._count = context.RawValue("q", 0)
        self._entries = context.RawArray("d", _ENTRIES * _WIDTH)

    def record(self, t_s: float, R_world_camera: Sequence[Sequence[float]]) -> None:
        """Record an orientation; times must ascend. R_world_camera: three rows."""
        x, y, z = R_world_camera
        count = self._count.value
        start = count % _ENTRIES * _WIDTH
        self._entries[start : start + _WIDTH] = [t_s, *x, *y, *z]
        self._count.value = count + 1

    def rotation_at(self, t_s: float) -> Floats | None:
        """Return R_world_camera (3, 3) at a time; None if it is not stored."""
        # The complete entries in the order of time: (n, 10).
        before = int(self._count.value)
        entries = np.frombuffer(self._entries, np.float64).reshape(_ENTRIES, _WIDTH).copy()
        after = int(self._count.value)
        first = 0 if after <= _ENTRIES - _MARGIN else after - _ENTRIES + _MARGIN
        known = entries[np.arange(first, before) % _ENTRIES]
        if not len(known) or t_s < known[0, 0] or t_s > known[-1, 0] + _NEWEST_SERVES_S:
            return None
        after = int(np.searchsorted(known[:, 0], t_s))
        if after == len(known):
            return known[-1, 1:].reshape(3, 3)
        if after == 0 or known[after, 0] == t_s:
            return known[after, 1:].reshape(3, 3)
        (t0, *R0), (t1, *R1) = known[after - 1], known[after]
        share = (t_s - t0) / (t1 - t0)
        # Between two orientations one tick apart: the rotation nearest to the mean of the matrices.
        U, _, Vt = np.linalg.svd(
            ((1.0 - share) * np.array(R0) + share * np.array(R1)).reshape(3, 3)
        )
        return np.asarray(U @ Vt)

    def rotation_between(self, now_s: float, before_s: float) -> Floats | None:
        """Return R_now_before (3, 3), which turns directions in camera axes; None if unknown."""
        now, before = self.rotation_at(now_s), self.rotation_at(before_s)
        return None if now is None or before is None else np.asarray(now.T @ before)

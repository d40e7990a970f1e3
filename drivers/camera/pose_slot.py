"""The newest pose of the head, written by the control loop, read by a process that draws its view.

No lock is needed (``DoubleBuffer``).
"""

from collections.abc import Sequence
from typing import NamedTuple

from gazerig.drivers.camera.double_buffer import CONTEXT, DoubleBuffer

_WIDTH = 13  # time, the rotation's nine numbers, the position

Row = tuple[float, float, float]


class PoseAt(NamedTuple):
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
        self._entries = CONTEXT.RawArray("d", 2 * _WIDTH)

    def record(
        self, t_s: float, R_world_head: Sequence[Sequence[float]], p_world_head_m: Sequence[float]
    ) -> None:
        """Record a pose; only one process writes."""
        if self._newest.count == 0:
            self._first_s.value = t_s
        x, y, z = R_world_head
        start = self._newest.older * _WIDTH
        self._entries[start : start + _WIDTH] = [t_s, *x, *y, *z, *p_world_head_m]
        self._newest.filled()

    @property
    def first_s(self) -> float:
        """Return the time of the first pose, seconds; 0 before it."""
        return float(self._first_s.value)

    def newest(self) -> PoseAt | None:
        """Return the newest pose, None before the first."""
        found = self._newest.read(self._copy)
        if found is None:
            return None
        t_s, *v = found[1]
        rows = (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8])
        return PoseAt(t_s, rows, (v[9], v[10], v[11]))

    def _copy(self, entry: int) -> list[float]:
        start = entry * _WIDTH
        return list(self._entries[start : start + _WIDTH])

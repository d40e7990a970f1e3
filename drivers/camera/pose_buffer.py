"""History of the camera's orientation, written by the control loop, read by the camera's process.

Motion detection needs the camera's own rotation between two frames. The ring is shared memory
without a lock: the loop writes an entry and then increments the count. The reader reads the count
before and after, and discards entries that may have been overwritten meanwhile.
"""

import multiprocessing
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ENTRIES = 512  # 2.5 s at 200 Hz
_WIDTH = 10  # time, and the rotation's nine numbers
_MARGIN = 8  # oldest entries that the loop may be overwriting
# A frame can be younger than the newest pose by a tick or two.
_NEWEST_SERVES_S = 0.05


class PoseBuffer:
    """Orientations of the camera over the last few seconds.

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

    def at(self, t_s: float) -> Floats | None:
        """Return R_world_camera (3, 3) at a time; None if it is not stored."""
        known = self._known()
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

    def turned(self, now_s: float, before_s: float) -> Floats | None:
        """Return R_now_before (3, 3), which turns directions in camera axes; None if unknown."""
        now, before = self.at(now_s), self.at(before_s)
        return None if now is None or before is None else np.asarray(now.T @ before)

    def _known(self) -> Floats:
        """Return the complete entries in the order of time: (n, 10)."""
        before = int(self._count.value)
        entries = np.frombuffer(self._entries, np.float64).reshape(_ENTRIES, _WIDTH).copy()
        after = int(self._count.value)
        first = 0 if after <= _ENTRIES - _MARGIN else after - _ENTRIES + _MARGIN
        return entries[np.arange(first, before) % _ENTRIES]

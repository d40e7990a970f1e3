"""Looks at a face and away from it, and times of mutual gaze."""

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, longest, mean, median
from gazerig.gaze.types import Floats

_FACING_DEG = 12.0
BRIDGED_S = 0.15
"""Gaps and looks that are shorter are ignored."""
HALF_WIDE_M, HALF_HIGH_M = 0.085, 0.125
"""Oval of an adult's face around the nose."""


def on_face(run: GazeTrace) -> NDArray[np.bool_]:
    """Return (n,) whether the gaze is inside the oval of a face."""
    y, z = run.column("face_y") / HALF_WIDE_M, run.column("face_z") / HALF_HIGH_M
    inside: NDArray[np.bool_] = np.nan_to_num(y * y + z * z, nan=9.0) <= 1.0
    return inside


def gaze_bouts(run: GazeTrace, mask: NDArray[np.bool_]) -> Floats:
    """Return (n, 3) start, end, and whether the run cut it off, of each interval of a mask."""
    t = run.column("t")
    if not len(t):
        return np.zeros((0, 3))
    edges = np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0)).reshape(-1, 2)
    out: list[list[float]] = []
    for first, last in edges:
        begin, end = float(t[first]), float(t[min(last, len(t) - 1)])
        cut = float(first == 0 or last >= len(t))
        if out and begin - out[-1][1] < BRIDGED_S:
            out[-1][1:] = [end, max(cut, out[-1][2])]
        else:
            out.append([begin, end, cut])
    rows = np.array(out).reshape(-1, 3)
    return np.asarray(rows[rows[:, 1] - rows[:, 0] >= BRIDGED_S])


def face_looks(run: GazeTrace) -> Floats:
    """Return the intervals of looks at a face, including those cut off."""
    return gaze_bouts(run, on_face(run))


def mutual_looks(run: GazeTrace) -> Floats:
    """Return the intervals in which both faces are turned to each other."""
    return gaze_bouts(run, on_face(run) & (run.column("face_off") < _FACING_DEG))


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of looks at people."""
    seen = face_looks(run)
    whole = _lengths(seen[seen[:, 2] == 0.0])
    both = mutual_looks(run)
    return [
        MeasuredValue("bout_none", whole, median),
        MeasuredValue("longest_look", _lengths(seen), longest),
        MeasuredValue("mutual", _lengths(both), mean),
    ]


def _lengths(rows: Floats) -> Floats:
    return np.asarray(rows[:, 1] - rows[:, 0])

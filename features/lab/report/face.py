"""Gaze on a face: parts, visits and shifts between them, vergence, and looks at people."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    longest,
    mean,
    median,
    weighted_mean,
)
from gazerig.gaze.types import PARTS, Floats
from gazerig.robot.model.face_geometry import PARTS_FACE_M

N = len(PARTS)
_EYES = (PARTS.index("LE"), PARTS.index("RE"))
_SETTLED_S = 0.04
_PAUSE_S = 0.3
"""Visits farther apart in time are not consecutive."""

_FACING_DEG = 12.0
BRIDGED_S = 0.15
"""Gaps and looks that are shorter are ignored."""
HALF_WIDE_M, HALF_HIGH_M = 0.085, 0.125
"""Oval of an adult's face around the nose."""

# Grid of the heat map: 4 mm, and half a degree at a distance of one metre.
GRID_M = np.arange(-0.1, 0.1001, 0.004), np.arange(-0.13, 0.1301, 0.004)
"""Centres of the cells of a density: sideways and up."""
_SPREAD_M = 0.0085


class Visit(NamedTuple):
    """Time on one part, including refixations."""

    part: int
    start_s: float
    end_s: float


def part_visits(run: GazeTrace) -> list[Visit]:
    """Return the visits to parts in their order."""
    out: list[Visit] = []
    for f in run.fixations:
        if f.part is None or not f.on_face:
            continue
        part = PARTS.index(f.part)
        if out and out[-1].part == part and f.start_s - out[-1].end_s < _PAUSE_S:
            out[-1] = out[-1]._replace(end_s=f.end_s)
        else:
            out.append(Visit(part, f.start_s, f.end_s))
    return out


def part_shifts(run: GazeTrace) -> NDArray[np.intp]:
    """Return (n, 2) from and to of shifts between parts, as indices of PARTS."""
    seen = part_visits(run)
    rows = [
        (a.part, b.part)
        for a, b in zip(seen, seen[1:], strict=False)
        if a.part != b.part and b.start_s - a.end_s < _PAUSE_S
    ]
    return np.array(rows, dtype=np.intp).reshape(-1, 2)


def shift_shares(rows: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return the share of shifts to each part, (8, 8) rows from, and the number from each, (8,)."""
    counts = np.zeros((N, N))
    np.add.at(counts, tuple(rows.T), 1.0)
    total = counts.sum(axis=1)
    return counts / np.maximum(total, 1.0)[:, None], total


def fixations_on_parts(run: GazeTrace) -> Floats:
    """Return (n, 2) part and seconds of every fixation on a part."""
    rows = [(PARTS.index(f.part), f.duration_s) for f in run.fixations if f.part is not None]
    return np.array(rows, dtype=float).reshape(-1, 2)


def part_shares(rows: Floats) -> Floats:
    """Return the share of time on each part, (8,)."""
    time = np.bincount(rows[:, 0].astype(int), weights=rows[:, 1], minlength=N)
    return np.asarray(time / time.sum())


@cache
def human_share() -> Floats:
    """Return the share of time that people spend on each part (Nakamoto & Tsuruno), (8,).

    Figures of bootstrap samples need it thousands of times, so it is computed once.
    """
    return human.time_share(human.transition_matrix(), human.DWELL_MEAN_S)


@cache
def human_shifts() -> Floats:
    """Return the share of people's shifts to each part, (8, 8) rows from; computed once."""
    return human.visit_matrix(human.transition_matrix())


def face_points(run: GazeTrace) -> Floats:
    """Return (n, 3) y and z on the face in metres, and seconds, of fixations with a face as target.

    The fixations may miss the face.
    """
    points = run.column("face")
    rows = []
    for f in run.fixations:
        rested = points[run.between(f.start_s + _SETTLED_S, f.end_s)]
        if f.is_face and np.isfinite(rested).any():
            rows.append((*np.nanmedian(rested, axis=0), f.duration_s))
    return np.array(rows).reshape(-1, 3)


def gaze_density(rows: Floats) -> Floats:
    """Spread (n, 3) y, z, seconds over the grid: (rows z, columns y)."""
    y, z = GRID_M
    edges = [np.append(centres - 0.002, centres[-1] + 0.002) for centres in (z, y)]
    time, _, _ = np.histogram2d(rows[:, 1], rows[:, 0], edges, weights=rows[:, 2])
    return np.asarray(_bell(1) @ time @ _bell(0))


@cache
def expected_density() -> Floats:
    """Return the density of people's share of time on the parts; computed once."""
    places = np.array([PARTS_FACE_M[part][1:] for part in PARTS])
    return gaze_density(np.column_stack([places, human_share()]))


@cache
def _bell(axis: int) -> Floats:
    """Return the weights (n, n) that spread time over the cells of an axis; computed once."""
    centres = GRID_M[axis]
    return np.asarray(np.exp(-0.5 * ((centres[:, None] - centres[None]) / _SPREAD_M) ** 2))


def map_axes(run: GazeTrace) -> Floats:
    """Return (n, 3) medians of fixations on a face, in deg.

    Columns: angles of the left and the right pupil axis from the target point; vergence error.
    """
    due = run.column("vergence") - run.column("vergence_due")
    table = np.column_stack([run.column("off"), due])
    on = (run.column("is_face") > 0.0) & np.isfinite(run.column("face_off"))
    parts = [run.between(f.start_s + _SETTLED_S, f.end_s) for f in run.fixations]
    rows = [np.median(table[part], axis=0) for part in parts if len(on[part]) and on[part].all()]
    return np.array(rows).reshape(-1, 3)


def face_looks(run: GazeTrace, mutual: bool = False) -> Floats:
    """Return (n, 3) start, end, and whether the run cut it off, of each look at a face.

    mutual: only if the face is turned to the robot too
    """
    t, inside = (
        run.column("t"),
        np.hypot(*(run.column("face") / (HALF_WIDE_M, HALF_HIGH_M)).T) <= 1.0,
    )
    if mutual:
        inside &= run.column("face_off") < _FACING_DEG
    out: list[list[float]] = []
    for part in run.slices(inside):
        begin, end = float(t[part.start]), float(t[min(part.stop, len(t) - 1)])
        cut = float(part.start == 0 or part.stop >= len(t))
        if out and begin - out[-1][1] < BRIDGED_S:
            out[-1][1:] = [end, max(cut, out[-1][2])]
        else:
            out.append([begin, end, cut])
    rows = np.array(out).reshape(-1, 3)
    return np.asarray(rows[rows[:, 1] - rows[:, 0] >= BRIDGED_S])


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of the gaze on faces and of looks at people."""
    parts, moves = fixations_on_parts(run), part_shifts(run)
    on_eyes = np.isin(parts[:, 0], _EYES).astype(float)
    forbidden = (human.transition_matrix() == 0.0)[tuple(moves.T)].astype(float)
    lengths = np.array([visit.end_s - visit.start_s for visit in part_visits(run)])
    meant = [(float(f.part is not None), f.duration_s) for f in run.fixations if f.is_face]
    left, right, vergence = map_axes(run).T
    passes = (vergence >= -2.5) & (vergence <= 4.5)
    direct = np.maximum(left, right) <= 0.5 * human.CONE_DEG
    (begins, ends, cut), mutual = face_looks(run).T, face_looks(run, mutual=True)
    return [
        MeasuredValue("on_parts", np.array(meant).reshape(-1, 2), weighted_mean),
        MeasuredValue("part_share", parts, _share_difference),
        MeasuredValue("eyes_share", np.column_stack([on_eyes, parts[:, 1]]), weighted_mean),
        MeasuredValue("visit", lengths, mean),
        MeasuredValue("never_taken", forbidden, mean),
        MeasuredValue("transitions", moves, _transition_difference),
        MeasuredValue("heat", face_points(run), _heat_correlation),
        MeasuredValue("in_cone", direct.astype(float), mean),
        MeasuredValue("vergence_ok", passes.astype(float), mean),
        MeasuredValue("bout_none", (ends - begins)[cut == 0.0], median),
        MeasuredValue("longest_look", ends - begins, longest),
        MeasuredValue("mutual", mutual[:, 1] - mutual[:, 0], mean),
    ]


def _share_difference(rows: Floats) -> float:
    """Return half the sum of the differences from people's shares: 0 equal, 1 disjoint."""
    return float(0.5 * np.abs(part_shares(rows) - human_share()).sum())


def _transition_difference(rows: NDArray[np.intp]) -> float:
    shares, total = shift_shares(rows)
    apart = 0.5 * np.abs(shares - human_shifts()).sum(axis=1)
    return float(np.average(apart, weights=total))


def _heat_correlation(rows: Floats) -> float:
    """Return the correlation of the heat map with the heat map expected of people."""
    ours = gaze_density(rows).ravel()
    if np.ptp(ours) == 0.0:  # no time on the face
        return 0.0
    return float(np.corrcoef(ours, expected_density().ravel())[0, 1])

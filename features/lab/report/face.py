"""Gaze on a face: parts, dwell times and transitions, and those of a walk over its parts."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, median
from gazerig.gaze.scanpath.dwell import Draw, lognormal_dwell
from gazerig.gaze.scanpath.models import spot_factor
from gazerig.gaze.scanpath.scanpath import ScanpathParams, Walk, normalise, steps_and_dwells
from gazerig.gaze.types import PARTS, Floats
from gazerig.robot.model.face_geometry import PARTS_FACE_M

N = len(PARTS)
_EYES = (PARTS.index("LE"), PARTS.index("RE"))
_SETTLED_S = 0.04
_PAUSE_S = 0.3
"""Visits farther apart in time are not consecutive."""

# Grid of the heat map: 4 mm, and half a degree at a distance of one metre.
_Y_M, _Z_M = np.arange(-0.1, 0.1001, 0.004), np.arange(-0.13, 0.1301, 0.004)
_SPREAD_M = 0.0085
GRID_M = (_Y_M, _Z_M)
"""Centres of the cells of a density: sideways and up."""


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


def part_shifts(run: GazeTrace) -> Floats:
    """Return (n, 2) from and to of shifts between parts, as indices of PARTS."""
    seen = part_visits(run)
    rows = [
        (a.part, b.part)
        for a, b in zip(seen, seen[1:], strict=False)
        if a.part != b.part and b.start_s - a.end_s < _PAUSE_S
    ]
    return np.array(rows, dtype=float).reshape(-1, 2)


def count_shifts(rows: Floats) -> Floats:
    """Return (8, 8) counts of shifts; rows are the parts of origin."""
    out = np.zeros((N, N))
    np.add.at(out, (rows[:, 0].astype(int), rows[:, 1].astype(int)), 1.0)
    return out


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
    out = human.time_share(human.transition_matrix(), human.DWELL_MEAN_S)
    out.setflags(write=False)
    return out


def face_points(run: GazeTrace) -> Floats:
    """Return (n, 3) y and z on the face in metres, and seconds, of fixations with a face as target.

    The fixations may miss the face.
    """
    y, z = run.column("face_y"), run.column("face_z")
    rows = []
    for f in run.fixations:
        rested = run.between(f.start_s + _SETTLED_S, f.end_s)
        if f.target_kind != "face" or not np.isfinite(y[rested]).any():
            continue
        rows.append((np.nanmedian(y[rested]), np.nanmedian(z[rested]), f.duration_s))
    return np.array(rows).reshape(-1, 3)


def gaze_density(rows: Floats) -> Floats:
    """Spread (n, 3) y, z, seconds over the grid: (rows z, columns y)."""
    z, y = _cells(rows[:, 1], _Z_M), _cells(rows[:, 0], _Y_M)
    on_grid = (z >= 0) & (z < len(_Z_M)) & (y >= 0) & (y < len(_Y_M))
    cells = z[on_grid] * len(_Y_M) + y[on_grid]
    time = np.bincount(cells, rows[on_grid, 2], len(_Z_M) * len(_Y_M))
    return np.asarray(_bell("z") @ time.reshape(len(_Z_M), len(_Y_M)) @ _bell("y"))


@cache
def expected_density() -> Floats:
    """Return the density of people's share of time on the parts; computed once."""
    places = np.array([PARTS_FACE_M[part][1:] for part in PARTS])
    out = gaze_density(np.column_stack([places, human_share()]))
    out.setflags(write=False)
    return out


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of the gaze on faces."""
    parts, moves, seen = fixations_on_parts(run), part_shifts(run), part_visits(run)
    on_eyes = np.isin(parts[:, 0], _EYES).astype(float)
    never = human.transition_matrix() == 0.0
    forbidden = never[moves[:, 0].astype(int), moves[:, 1].astype(int)].astype(float)
    lengths = np.array([visit.end_s - visit.start_s for visit in seen])
    meant = [
        (float(f.part is not None), f.duration_s) for f in run.fixations if f.target_kind == "face"
    ]
    rows = map_axes(run)
    vergence = rows[:, 6]
    good = (vergence >= -2.5) & (vergence <= 4.5)
    within = np.maximum(rows[:, 4], rows[:, 5]) <= 0.5 * human.CONE_DEG
    return [
        MeasuredValue("on_parts", np.array(meant).reshape(-1, 2), _weighted_mean),
        MeasuredValue("part_share", parts, _share_difference),
        MeasuredValue("eyes_share", np.column_stack([on_eyes, parts[:, 1]]), _weighted_mean),
        MeasuredValue("visit", lengths, mean),
        MeasuredValue("never_taken", forbidden, mean),
        MeasuredValue("transitions", moves, _transition_difference),
        MeasuredValue("heat", face_points(run), _heat_correlation),
        MeasuredValue("left_mm", np.hypot(rows[:, 0], rows[:, 1]), median),
        MeasuredValue("right_mm", np.hypot(rows[:, 2], rows[:, 3]), median),
        MeasuredValue("in_cone", within.astype(float), mean),
        MeasuredValue("vergence", vergence, median),
        MeasuredValue("vergence_ok", good.astype(float), mean),
    ]


def map_axes(run: GazeTrace) -> Floats:
    """Return (n, 7) medians of fixations on a face.

    Columns: miss distance of the left, then of the right pupil axis from the target point (y, z, in
    mm of the face's plane); angles of both from it, in deg; vergence error, in deg.
    """
    names = ("left_y_mm", "left_z_mm", "right_y_mm", "right_z_mm", "off_left", "off_right")
    due = run.column("vergence") - run.column("vergence_due")
    table = np.column_stack([run.columns(*names), due])
    parts = [table[run.between(f.start_s + _SETTLED_S, f.end_s)] for f in run.fixations
             if f.target_kind == "face"]  # fmt: skip
    rows = [np.median(part, axis=0) for part in parts if len(part)]
    found = np.array(rows).reshape(-1, 7)
    return np.asarray(found[np.isfinite(found).all(axis=1)])


def _share_difference(rows: Floats) -> float:
    """Return half the sum of the differences from people's shares: 0 equal, 1 disjoint."""
    return float(0.5 * np.abs(part_shares(rows) - human_share()).sum())


def _transition_difference(rows: Floats) -> float:
    """Return that difference for the rows of the transition matrix, weighted by their shifts."""
    counts = count_shifts(rows)
    total = counts.sum(axis=1)
    here = total > 0.0
    ours = counts[here] / total[here, None]
    apart = 0.5 * np.abs(ours - human.visit_matrix(human.transition_matrix())[here]).sum(axis=1)
    return float(np.average(apart, weights=total[here]))


def _weighted_mean(rows: Floats) -> float:
    return float(np.average(rows[:, 0], weights=rows[:, 1]))


def _heat_correlation(rows: Floats) -> float:
    """Return the correlation of the heat map with the heat map expected of people."""
    ours = gaze_density(rows).ravel()
    if np.ptp(ours) == 0.0:  # no time on the face
        return 0.0
    return float(np.corrcoef(ours, expected_density().ravel())[0, 1])


def _cells(places: Floats, centres: Floats) -> NDArray[np.intp]:
    """Return the index of each place's cell on an axis; an invalid index outside the axis."""
    step = centres[1] - centres[0]
    out: NDArray[np.intp] = np.floor((places - centres[0]) / step + 0.5).astype(np.intp)
    return out


@cache
def _bell(axis: str) -> Floats:
    """Return the weights (n, n) that spread time over the cells of an axis; computed once."""
    centres = _Z_M if axis == "z" else _Y_M
    return np.asarray(np.exp(-0.5 * ((centres[:, None] - centres[None]) / _SPREAD_M) ** 2))


_DRAWS = 3000


class ReferenceWalk:
    """A chain of steps with a dwell each (Nakamoto & Tsuruno 3.2); staying lengthens a visit.

    Args:
        steps: (8, 8) transition probabilities in the order of PARTS, rows from.
        dwells: the dwell law of each part.
    """

    def __init__(self, steps: Floats, dwells: Sequence[Draw]) -> None:
        self._steps, self._laws = steps, tuple(dwells)

    def visits(self, part: int, count: int, rng: np.random.Generator) -> Floats:
        """Draw random durations of visits to a part, in s."""
        steps = rng.geometric(1.0 - self._steps[part, part], count)
        return np.array([self._dwells(part, int(n), rng).sum() for n in steps])

    def share(self, rng: np.random.Generator) -> Floats:
        """Return the share of time on each part, (8,)."""
        mean = [float(self._dwells(part, _DRAWS, rng).mean()) for part in range(len(self._laws))]
        return human.time_share(self._steps, mean)

    def _dwells(self, part: int, count: int, rng: np.random.Generator) -> Floats:
        return np.array([self._laws[part](rng) for _ in range(count)])


def published_walk() -> ReferenceWalk:
    """Return the walk of Nakamoto & Tsuruno, eq 1 and table 1."""
    table = zip(human.DWELL_MEAN_S, human.DWELL_SD_S, strict=True)
    return ReferenceWalk(
        human.transition_matrix(), [lognormal_dwell(mean, sd) for mean, sd in table]
    )


def rig_walk(params: ScanpathParams, walk: Walk) -> ReferenceWalk | None:
    """Return the walk of a rig's parameters, None for another scanpath model."""
    if params.model != "markov":
        return None
    steps, dwells = steps_and_dwells(params, walk)
    order = [walk.order.index(part) for part in PARTS]
    steps = steps[np.ix_(order, order)]
    if params.law == "people":
        spot_m = params.spot_height_mm / 1e3
        steps = normalise(steps * [spot_factor(spot_m, PARTS_FACE_M[part][2]) for part in PARTS])
    return ReferenceWalk(steps, [dwells[i] for i in order])

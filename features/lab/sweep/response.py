"""Response of the figures of a sweep to its parameters: groups of runs and strongest responses."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gazerig.features.lab.sweep.axes import Axis
from gazerig.features.lab.sweep.outcome import OUTSIDE, REPORT, Outcome
from gazerig.gaze.types import Floats
from gazerig.robot.analysis.human_norms import BANDS, BY_KEY, NormBand

_BINS = 5
_WEAK = 0.05
"""Measures with a weaker response get no panel."""


class LevelGroup(NamedTuple):
    """The runs at one level of an axis, or in one part of a range.

    at: position on the axis; values: a column's figures in these runs
    """

    at: float
    values: Floats


def is_number(value: object) -> bool:
    """Return whether a value fits on a numeric axis."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def positions(axis: Axis, outcomes: Sequence[Outcome]) -> Floats:
    """Return the position of each run on an axis: its number, or the index of its level."""
    if axis.is_range or all(is_number(value) for value in axis.values):
        return np.array([float(str(one.point[axis.key])) for one in outcomes])
    return np.array([float(axis.index(one.point[axis.key])) for one in outcomes])


def column(name: str, outcomes: Sequence[Outcome]) -> Floats:
    """Return a column's figure in each run, nan if missing."""
    found = (one.figures.get(name) for one in outcomes)
    return np.array([float(x) if isinstance(x, int | float) else np.nan for x in found])


def groups(axis: Axis, at: Floats, values: Floats) -> list[LevelGroup]:
    """Return the runs by level of an axis; for a range, by parts with equally many runs."""
    known = np.isfinite(values)
    at, values = at[known], values[known]
    if not axis.is_range:
        return [LevelGroup(float(x), values[at == x]) for x in np.unique(at)]
    order = np.argsort(at, kind="stable")
    parts = np.array_split(order, max(1, min(_BINS, len(order) // 2)))
    return [LevelGroup(float(at[part].mean()), values[part]) for part in parts if len(part)]


def strength(axes: Sequence[Axis], outcomes: Sequence[Outcome], band: NormBand) -> float:
    """Return the strongest response of a measure to any parameter, 0..1.

    The response is the share of variance that a parameter explains, less the share that as many
    groups explain by chance (epsilon squared, Kelley 1935), times the change of the mean in widths
    of its band, at most 1.
    """
    values = column(f"{REPORT}{band.key}", outcomes)
    best = 0.0
    for axis in axes:
        parts = [part.values for part in groups(axis, positions(axis, outcomes), values)]
        n, k = sum(map(len, parts)), len(parts)
        if k < 2 or n <= k:
            continue
        total = float(np.var(np.concatenate(parts))) * n
        within = sum(float(np.var(part)) * len(part) for part in parts)
        change = float(np.ptp([part.mean() for part in parts])) / (band.high - band.low)
        if total > 0.0:
            explained = 1.0 - (within / (n - k)) / (total / (n - 1))
            best = max(best, explained * min(1.0, change))
    return best


def most_responsive(axes: Sequence[Axis], outcomes: Sequence[Outcome], most: int) -> list[str]:
    """Return columns to show: measures outside their bands, then the strongest responses."""
    found = {f"{REPORT}{band.key}": strength(axes, outcomes, band) for band in BANDS}
    order = sorted(found, key=lambda name: -found[name])
    return [OUTSIDE, *(name for name in order if found[name] > _WEAK)][:most]


def band_of(name: str) -> NormBand | None:
    """Return the band of a measure's column, None for any other column."""
    return BY_KEY.get(name.removeprefix(REPORT)) if name.startswith(REPORT) else None

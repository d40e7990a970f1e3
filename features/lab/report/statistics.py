"""Measures (rows, one per event, and their statistic), and the verdict by a pass band."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis.human_norms import BY_KEY, NormBand
from gazerig.gaze.types import Floats

VerdictWord = Literal["pass", "uncertain", "outside", "too few events", "not judged"]
"""uncertain: the figure is outside, but its interval reaches into the band; not judged: the run's
servos say nothing about it"""

Statistic = Callable[[Any], float]
"""Rows (n,) or (n, k), one an event -> the figure."""

_DRAWS = 300
_SEED = 20060301
_Z95 = 1.96


@dataclass(frozen=True)
class MeasuredValue:
    """The data of one measure in a run.

    key: key of its band; rows: one row an event; statistic: the statistic
    commanded: rows of the models' commands, None if unknown
    count: number of events, if a row is not an event
    """

    key: str
    rows: NDArray[Any]
    statistic: Statistic
    commanded: Floats | None = None
    count: int | None = None

    @property
    def band(self) -> NormBand:
        """Return the range of people."""
        return BY_KEY[self.key]

    @property
    def events(self) -> int:
        """Return the number of events."""
        return len(self.rows) if self.count is None else self.count

    @property
    def commanded_value(self) -> float:
        """Return the same figure of the models' commands, nan if unknown."""
        return nan if self.commanded is None else self.value_of(self.commanded)

    def value_of(self, rows: NDArray[Any]) -> float:
        """Return the figure of rows, nan without rows."""
        return float(self.statistic(rows)) if len(rows) else nan


class MeasureResult(NamedTuple):
    """A measure with its verdict.

    value, low95, high95: the figure and its 95 % interval, nan if unknown
    """

    measured: MeasuredValue
    value: float
    low95: float
    high95: float
    verdict: VerdictWord

    @property
    def band(self) -> NormBand:
        """Return the range of people."""
        return self.measured.band


def judge(measured: MeasuredValue, interval: bool = True, blind: bool = False) -> MeasureResult:
    """Compare a figure and its interval with its pass band.

    A figure outside whose interval reaches into the band is uncertain: a run of a person could have
    shown it. A figure inside passes, whatever its interval.

    Args:
        measured: The measure.
        interval: Whether to compute the interval, without which nothing is uncertain.
        blind: Whether the run's servos say nothing about it.
    """
    band, value, low, high = measured.band, measured.value_of(measured.rows), nan, nan
    verdict: VerdictWord = "outside"
    if blind:
        verdict = "not judged"
    elif measured.events < band.least or not isfinite(value):
        verdict = "too few events"
    elif band.low <= value <= band.high:
        verdict = "pass"
    if interval and verdict in ("pass", "outside"):
        low, high = confidence_interval(measured)
        if verdict == "outside" and low <= band.high and high >= band.low:
            verdict = "uncertain"
    return MeasureResult(measured, value, low, high, verdict)


def confidence_interval(measured: MeasuredValue) -> tuple[float, float]:
    """Return the 95 % interval of a figure, (nan, nan) for an extreme, which has no interval.

    Shares have the score interval of Wilson (1927), which is valid for few events too; all others
    that of the bootstrap (Efron 1979).
    """
    rows, n = measured.rows, len(measured.rows)
    if measured.statistic is longest:
        return nan, nan
    if measured.statistic is mean and rows.ndim == 1 and np.isin(rows, (0.0, 1.0)).all():
        share, z2 = float(rows.mean()), _Z95 * _Z95
        middle = (share + 0.5 * z2 / n) / (1.0 + z2 / n)
        half = _Z95 * sqrt(share * (1.0 - share) / n + 0.25 * z2 / n**2) / (1.0 + z2 / n)
        # Rounding must not exclude the share itself.
        return min(share, middle - half), max(share, middle + half)
    rng = np.random.default_rng(_SEED)
    values = np.array([measured.value_of(rows[rng.integers(0, n, n)]) for _ in range(_DRAWS)])
    values = values[np.isfinite(values)]
    if not len(values):
        return nan, nan
    # Figures that cannot be below 0 are biased upwards in samples: the bias is subtracted.
    bias = values.mean() - measured.value_of(rows)
    low, high = np.percentile(values, (2.5, 97.5)) - bias
    return float(low), float(high)


def median(rows: Floats) -> float:
    """Return the median."""
    return float(np.median(rows))


def mean(rows: Floats) -> float:
    """Return the mean, which is a share if rows are 0 or 1."""
    return float(np.mean(rows))


def longest(rows: Floats) -> float:
    """Return the largest."""
    return float(np.max(rows))


def rate(rows: Floats) -> float:
    """Return events a second of (n, 2) events and seconds."""
    return float(rows[:, 0].sum() / rows[:, 1].sum())


def weighted_mean(rows: Floats) -> float:
    """Return the mean of (n, 2) values and weights."""
    return float(np.average(rows[:, 0], weights=rows[:, 1]))

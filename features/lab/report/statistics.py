"""Measures (rows, one per event, and their statistic), and the verdict by a pass band."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from math import isfinite, nan, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis.human_norms import NormBand
from gazerig.gaze.types import Floats

VerdictWord = Literal["pass", "uncertain", "outside", "too few events"]
"""uncertain: the figure is outside, but its interval reaches into the band"""

Indices = NDArray[np.int64]
Statistic = Callable[[Floats], float]
"""Rows (n,) or (n, k), one an event -> the figure."""

_DRAWS = 300
_SEED = 20060301
_Z95 = 1.96
_AT_ONCE = 250_000
"""Rows of samples in one evaluation: 2 MB."""


@dataclass(frozen=True)
class MeasuredValue:
    """The data of one measure in a run.

    key: key of its band; rows: one row an event; statistic: the statistic
    commanded_value: the same figure of the models' commands, nan if unknown
    count: number of events, if a row is not an event
    """

    key: str
    rows: Floats
    statistic: Statistic
    commanded_value: float = nan
    count: int | None = None

    @property
    def events(self) -> int:
        """Return the number of events."""
        return len(self.rows) if self.count is None else self.count


class MeasureResult(NamedTuple):
    """A measure with its verdict.

    value, low95, high95: the figure and its 95 % interval, nan if unknown
    """

    band: NormBand
    measured: MeasuredValue
    value: float
    low95: float
    high95: float
    verdict: VerdictWord


def judge(measured: MeasuredValue, band: NormBand) -> MeasureResult:
    """Compare a figure and its interval with its pass band.

    A figure outside whose interval reaches into the band is uncertain: a run of a person could have
    shown it. A figure inside passes, whatever its interval.
    """
    result = judge_without_interval(measured, band)
    if result.verdict == "too few events":
        return result
    low, high = confidence_interval(measured)
    reaches = low <= band.high and high >= band.low
    verdict = "uncertain" if result.verdict == "outside" and reaches else result.verdict
    return result._replace(low95=low, high95=high, verdict=verdict)


def confidence_interval(measured: MeasuredValue) -> tuple[float, float]:
    """Return the 95 % interval of a figure, (nan, nan) for an extreme, which has no interval.

    Shares have the score interval of Wilson (1927), which is valid for few events too; all others
    that of the bootstrap (Efron 1979).
    """
    rows, of = measured.rows, measured.statistic
    if of is longest:
        return nan, nan
    if of is mean and rows.ndim == 1 and np.isin(rows, (0.0, 1.0)).all():
        share = float(rows.mean())
        n = len(rows)
        z2 = _Z95 * _Z95
        middle = (share + 0.5 * z2 / n) / (1.0 + z2 / n)
        half = _Z95 * sqrt(share * (1.0 - share) / n + 0.25 * z2 / n**2) / (1.0 + z2 / n)
        # Rounding must not exclude the share itself.
        return min(share, middle - half), max(share, middle + half)
    return unbiased_interval(
        bootstrap(measured, np.random.default_rng(_SEED)), measured_value(of, rows)
    )


def unbiased_interval(spread: Floats, value: float) -> tuple[float, float]:
    """Return the 95 % interval of a value from the values of bootstrap samples.

    Figures that cannot be below 0 are biased upwards in bootstrap samples: the bias is subtracted.
    """
    low, high = np.percentile(spread, (2.5, 97.5)) - (spread.mean() - value)
    return float(low), float(high)


def judge_without_interval(measured: MeasuredValue, band: NormBand) -> MeasureResult:
    """Compare a figure with its pass band, without an interval; too few events do not pass."""
    value = measured_value(measured.statistic, measured.rows)
    verdict: VerdictWord = "outside"
    if measured.events < band.min_events or not isfinite(value):
        verdict = "too few events"
    elif band.low <= value <= band.high:
        verdict = "pass"
    return MeasureResult(band, measured, value, nan, nan, verdict)


def bootstrap(measured: MeasuredValue, rng: np.random.Generator, draws: int = _DRAWS) -> Floats:
    """Return the figure of ``draws`` bootstrap samples of the events (Efron 1979)."""
    rows, n = measured.rows, len(measured.rows)
    values = measured_values(
        measured.statistic, rows, (rng.integers(0, n, n) for _ in range(draws))
    )
    found = values[np.isfinite(values)]
    return found if len(found) else np.array([nan])


def measured_value(of: Statistic, rows: Floats) -> float:
    """Return the figure of rows, nan without rows."""
    if not len(rows):
        return nan
    return float(of(rows))


def measured_values(of: Statistic, rows: Floats, samples: Iterable[Indices]) -> Floats:
    """Return the figure of each sample of the rows.

    Statistics with an axis in NumPy are evaluated for many samples at once.

    Args:
        of: the statistic.
        rows: (n,) or (n, k), one an event.
        samples: indices of rows, as many in each sample.
    """
    along = _ALONG.get(of) if rows.ndim == 1 else None
    if along is None or not len(rows):
        return np.array([measured_value(of, rows[sample]) for sample in samples])
    waiting, found = iter(samples), [np.empty(0)]
    while some := list(islice(waiting, max(1, _AT_ONCE // len(rows)))):
        found.append(along(rows[np.array(some)]))
    return np.concatenate(found)


def median(rows: Floats) -> float:
    """Return the median."""
    return float(np.median(rows))


def mean(rows: Floats) -> float:
    """Return the mean, which is a share if rows are 0 or 1."""
    return float(np.mean(rows))


def spread_over_mean(rows: Floats) -> float:
    """Return the standard deviation over the mean."""
    return float(np.std(rows, ddof=1) / np.mean(rows)) if len(rows) > 1 else nan


def one_over_mean(rows: Floats) -> float:
    """Return events a second from the intervals between them."""
    return float(1.0 / np.mean(rows))


def longest(rows: Floats) -> float:
    """Return the largest."""
    return float(np.max(rows))


def _spreads_over_means(rows: Floats) -> Floats:
    if rows.shape[1] < 2:
        return np.full(len(rows), nan)
    return np.asarray(np.std(rows, axis=1, ddof=1) / np.mean(rows, axis=1))


_ALONG: Mapping[Statistic, Callable[[Floats], Floats]] = {
    median: lambda rows: np.median(rows, axis=1),
    mean: lambda rows: np.mean(rows, axis=1),
    spread_over_mean: _spreads_over_means,
    one_over_mean: lambda rows: 1.0 / np.mean(rows, axis=1),
    longest: lambda rows: np.max(rows, axis=1),
}
"""Versions of the statistics for many samples at once, (samples, n) -> (samples,)."""


def format_number(value: float) -> str:
    """Return a number with a useful number of digits."""
    size = abs(value)
    if size >= 100.0:
        return f"{value:.0f}"
    if size >= 10.0:
        return f"{value:.1f}".rstrip("0").rstrip(".")
    text = f"{value:.2f}" if size >= 0.1 or value == 0.0 else f"{value:.3f}"
    text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text

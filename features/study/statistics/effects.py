"""Results of tests, effect sizes with their 95 % intervals, and Cronbach's alpha of a scale.

Intervals are those of the bias-corrected and accelerated bootstrap (Efron 1987) over participants;
they are nan if it is undefined, because all participants answered alike.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np
from scipy import special, stats

from gazerig.features.study.design import Test
from gazerig.gaze.types import Floats


class EffectSize(NamedTuple):
    """An effect with its 95 % interval, nan without one.

    name: in words; symbol: as printed; method: of the interval
    bounded: whether it cannot exceed 1, so that no zero is printed before the decimal point
    """

    name: str
    symbol: str
    value: float
    low95: float
    high95: float
    method: str
    bounded: bool = True


@dataclass(frozen=True)
class StatisticalTest:
    """The results of one test.

    symbol, statistic, df: as printed; df is nan for a statistic without degrees of freedom
    p: p value from the statistic's distribution in large samples
    exact_p: p value from the permutations of the data, nan if it was not computed
    least_p: the smallest exact probability that is possible with this number of data
    n: participants, or answers if each counts separately
    notes: warnings for the reader, e.g. counts too small for the large-sample probability
    """

    key: Test
    symbol: str
    statistic: float
    df: float
    p: float
    exact_p: float
    least_p: float
    n: int
    effect: EffectSize
    notes: tuple[str, ...] = ()

    @property
    def deciding_p(self) -> float:
        """Return the exact probability if it is known, else that of large samples."""
        return self.exact_p if isfinite(self.exact_p) else self.p


def no_effect(name: str, symbol: str) -> EffectSize:
    """Return an undefined effect."""
    return EffectSize(name, symbol, nan, nan, nan, "none")


def cronbachs_alpha(answers: Floats) -> EffectSize:
    """Return Cronbach's alpha (1951) of a scale, with its interval over participants.

    Args:
        answers: (participants, items), with reversed items inverted.
    """
    rows = np.asarray(answers, float)
    name = "Cronbach's alpha"
    if rows.ndim != 2 or rows.shape[0] < 2 or rows.shape[1] < 2:
        return EffectSize(name, "α", nan, nan, nan, "none")

    def along(*items: Floats, axis: int = -1) -> Floats:
        return _alpha(np.stack(items))

    interval = bootstrap_interval(list(rows.T), along, paired=True)
    return EffectSize(name, "α", float(_alpha(rows.T)), *interval, "BCa bootstrap")


def _alpha(items: Floats) -> Floats:
    """Return alpha of (items, ..., participants), nan if all sums are equal."""
    k = len(items)
    parts = np.var(items, axis=-1, ddof=1).sum(axis=0)
    whole = np.asarray(np.var(items.sum(axis=0), axis=-1, ddof=1))
    share = np.divide(parts, whole, out=np.full_like(whole, nan), where=whole > 1e-12)
    alpha: Floats = k / (k - 1.0) * (1.0 - share)
    return alpha


RESAMPLES = 2000
SEED = 20020401
_BCA = "BCa bootstrap"
_NO_CENTRE = 1e-9

Along = Callable[..., Floats]
"""Samples (..., n), each along its last axis -> statistics (...)."""


def rank_biserial(differences: Floats, resamples: int = RESAMPLES) -> EffectSize:
    """Return the matched-pairs rank-biserial correlation (Kerby 2014).

    Args:
        differences: (n,) one per participant; zeros count for neither side.
        resamples: of the bootstrap.
    """
    interval = bootstrap_interval([differences], matched_correlation, resamples)
    value = float(matched_correlation(differences))
    return EffectSize("matched rank-biserial correlation", "r", value, *interval, _BCA)


def matched_correlation(differences: Floats, axis: int = -1) -> Floats:
    """Return (W+ - W-) / (W+ + W-) of differences along an axis, nan if all are zero."""
    d = np.moveaxis(np.asarray(differences, float), axis, -1)
    zeros = np.count_nonzero(d == 0.0, axis=-1, keepdims=True)
    # Zeros have the lowest ranks, so the other ranks are too high by the number of zeros.
    ranks = np.where(d == 0.0, 0.0, stats.rankdata(np.abs(d), axis=-1) - zeros)
    total = ranks.sum(axis=-1)
    signed = (np.sign(d) * ranks).sum(axis=-1)
    share: Floats = np.divide(signed, total, out=np.full_like(total, nan), where=total > 0.0)
    return share


def cliffs_delta(a: Floats, b: Floats, paired: bool, resamples: int = RESAMPLES) -> EffectSize:
    """Return Cliff's delta (1993): excess of pairs with b above a over pairs with a above b.

    Args:
        a: (n,) answers.
        b: (m,) others.
        paired: the same participants in the same order gave both; they are resampled together.
        resamples: of the bootstrap.
    """
    interval = bootstrap_interval([a, b], dominance, resamples, paired)
    return EffectSize("Cliff's delta", "δ", float(dominance(a, b)), *interval, _BCA)


def dominance(a: Floats, b: Floats, axis: int = -1) -> Floats:
    """Return P(b > a) - P(b < a) of samples along an axis."""
    a, b = np.moveaxis(np.asarray(a, float), axis, -1), np.moveaxis(np.asarray(b, float), axis, -1)
    n, m = a.shape[-1], b.shape[-1]
    ranks = stats.rankdata(np.concatenate([a, b], axis=-1), axis=-1)
    over = ranks[..., n:].sum(axis=-1) - 0.5 * m * (m + 1)
    difference: Floats = 2.0 * over / (n * m) - 1.0
    return difference


def cohens_dz(differences: Floats, resamples: int = RESAMPLES) -> EffectSize:
    """Return Cohen's d_z: the mean of the differences over their standard deviation.

    Args:
        differences: (n,) one per participant.
        resamples: of the bootstrap.
    """
    interval = bootstrap_interval([differences], standardised_mean, resamples)
    value = float(standardised_mean(differences)) if len(differences) > 1 else nan
    return EffectSize("Cohen's d_z", "d_z", value, *interval, _BCA, bounded=False)


def standardised_mean(differences: Floats, axis: int = -1) -> Floats:
    """Return mean over standard deviation along an axis, nan if all are equal."""
    mean = np.asarray(np.mean(differences, axis=axis))
    spread = np.asarray(np.std(differences, axis=axis, ddof=1))
    ratio: Floats = np.divide(mean, spread, out=np.full_like(mean, nan), where=spread > 1e-12)
    return ratio


def kendalls_w(rows: Floats, resamples: int = RESAMPLES) -> EffectSize:
    """Return Kendall's coefficient of concordance, corrected for ties.

    Args:
        rows: (participants, conditions).
        resamples: of the bootstrap.
    """
    columns = list(rows.T)

    def along(*samples: Floats, axis: int = -1) -> Floats:
        return concordance(np.moveaxis(np.stack(samples), 0, -1))

    interval = bootstrap_interval(columns, along, resamples, paired=True)
    return EffectSize("Kendall's W", "W", float(concordance(rows)), *interval, _BCA)


def concordance(rows: Floats) -> Floats:
    """Return Kendall's W of (..., participants, conditions), nan if all rows are ties."""
    n, k = rows.shape[-2:]
    ranks = stats.rankdata(rows, axis=-1)
    apart = ((ranks.sum(axis=-2) - 0.5 * n * (k + 1)) ** 2).sum(axis=-1)
    # The spread within rows is k (k^2 - 1) / 12 minus the part of ties.
    most = n * ((ranks - 0.5 * (k + 1)) ** 2).sum(axis=(-1, -2))
    share: Floats = np.divide(apart, most, out=np.full_like(apart, nan), where=most > 0.0)
    return share


def cramers_v(chi2: float, n: int, shape: tuple[int, int]) -> EffectSize:
    """Return Cramer's V of a table.

    The interval is that of the inverted noncentral chi-square distribution (Smithson 2003).
    """
    df, width = (shape[0] - 1) * (shape[1] - 1), n * (min(shape) - 1)
    if df < 1 or width < 1 or not isfinite(chi2):
        return EffectSize("Cramér's V", "V", nan, nan, nan, "none")
    value = sqrt(chi2 / width)
    low, high = special.chndtrinc(chi2, df, (0.975, 0.025))  # the noncentralities, 0 at the least
    bounds = (0.0 if low < _NO_CENTRE else sqrt((low + df) / width), sqrt((high + df) / width))
    method = "noncentral chi-square"
    return EffectSize(
        "Cramér's V", "V", value, min(value, bounds[0]), max(value, min(1.0, bounds[1])), method
    )


def bootstrap_interval(
    samples: Sequence[Floats], figure: Along, resamples: int = RESAMPLES, paired: bool = False
) -> tuple[float, float]:
    """Return the 95 % BCa interval of a statistic, (nan, nan) if it is undefined.

    Args:
        samples: each (n,); with ``paired`` all of the same participants.
        figure: the statistic, vectorised along an axis.
        resamples: number of resamplings of the participants.
        paired: the samples are drawn together.
    """
    if min(len(s) for s in samples) < 3 or all(np.ptp(s) == 0.0 for s in samples):
        return nan, nan
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # SciPy warns of a degenerate bootstrap distribution; the interval is then nan.
        warnings.simplefilter("ignore")
        found = stats.bootstrap(
            samples, figure, n_resamples=resamples, paired=paired, vectorized=True, axis=-1,
            method="BCa", rng=np.random.default_rng(SEED),
        ).confidence_interval  # fmt: skip
    low, high = float(found.low), float(found.high)
    return (low, high) if isfinite(low) and isfinite(high) else (nan, nan)

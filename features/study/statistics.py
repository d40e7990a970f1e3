"""Tests of one hypothesis on the answers of the same people, with exact p values and effects.

Large-sample p values are SciPy's, corrected for ties and for continuity; exact ones count all
signs or swaps of the participants' answers, including midranks (Streitberg & Roehmel 1986).
"""

import warnings
from collections.abc import Callable, Sequence
from math import nan
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from gazerig.features.study.design import Test
from gazerig.gaze.types import Floats

RESAMPLES, SEED = 2000, 20020401


class StatisticalTest(NamedTuple):
    """The results of one test.

    p: from the statistic's distribution in large samples; exact_p: nan if it was not computed
    effect, low, high: effect size with its 95 % interval: matched rank-biserial correlation,
        Cliff's delta, net share of participants or Cramer's V
    """

    key: Test
    statistic: float
    p: float
    exact_p: float
    effect: float
    low: float = nan
    high: float = nan


def signed_rank_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test the participants' differences: Wilcoxon's signed-rank test, zeros left out."""
    d = better - than
    d = d[d != 0.0]
    found = stats.wilcoxon(d, correction=True, method="asymptotic")
    exact = exact_sign_p(np.sign(d) * stats.rankdata(np.abs(d)))
    return _with_interval("signed_rank", found, exact, matched_correlation, better, than)


def rank_sum_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether answers tend to be higher: Wilcoxon's rank-sum (Mann and Whitney's U).

    The large-sample p value treats both answers of a participant as those of two people; the exact
    one swaps each participant's two answers, and is valid for any dependence between them.
    """
    found = stats.mannwhitneyu(better, than, method="asymptotic")
    ranks = stats.rankdata([better, than]).reshape(2, -1)
    exact = exact_sign_p(ranks[0] - ranks[1])
    return _with_interval("rank_sum", found, exact, dominance, better, than)


def sign_test(leans: Floats) -> StatisticalTest:
    """Test whether more participants chose one side: the exact sign test.

    Args:
        leans: (participants,) choices of the one side minus those of the other, not all zero.
    """
    above, kept = int((leans > 0.0).sum()), int(np.count_nonzero(leans))
    found = stats.binomtest(above, kept)
    shares = (above / kept, *found.proportion_ci(0.95))
    effects = (2.0 * float(share) - 1.0 for share in shares)
    return StatisticalTest("sign", above, float(found.pvalue), float(found.pvalue), *effects)


def chi_square_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether single answers have one distribution: Pearson's chi-square of the counts.

    Without correction for continuity, and with each answer as another person's.
    """
    table = np.array(
        [[np.sum(side == x) for x in np.union1d(better, than)] for side in (better, than)]
    )
    found = stats.chi2_contingency(table, correction=False)
    effect = float(np.sqrt(found.statistic / table.sum()))
    return StatisticalTest("chi_square", float(found.statistic), float(found.pvalue), nan, effect)


def exact_sign_p(scores: Floats) -> float:
    """Return the share of all signs of scores (n,), halves allowed, with as extreme a sum."""
    doubled = np.rint(2.0 * scores).astype(np.int64)
    chances = np.zeros(int(np.abs(doubled).sum()) + 1)
    chances[0] = 1.0
    for size in np.abs(doubled):
        chances = 0.5 * (chances + np.roll(chances, size))  # what is rolled over is zero
    seen = int(doubled[doubled > 0].sum())
    return min(1.0, 2.0 * float(min(chances[seen:].sum(), chances[: seen + 1].sum())))


def correct_p_values(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected by Holm's step-down procedure (1979), in their order."""
    corrected, least = list(p_values), 0.0
    for rank, k in enumerate(np.argsort(p_values)):
        least = max(least, min(1.0, (len(p_values) - rank) * p_values[k]))
        corrected[k] = least
    return corrected


def matched_correlation(better: Floats, than: Floats) -> float:
    """Return the matched-pairs rank-biserial correlation (Kerby 2014), nan without differences."""
    d = better - than
    ranks = stats.rankdata(np.abs(d[d != 0.0]))
    return float((np.sign(d[d != 0.0]) * ranks).sum() / ranks.sum()) if len(ranks) else nan


def dominance(better: Floats, than: Floats) -> float:
    """Return Cliff's delta (1993): P(better > than) - P(better < than)."""
    return float(np.sign(np.subtract.outer(better, than)).mean())


def cohens_dz(better: Floats, than: Floats) -> float:
    """Return the mean of the differences over their standard deviation, nan if all are equal."""
    spread = float(np.std(better - than, ddof=1))
    return float((better - than).mean()) / spread if spread > 1e-12 else nan


def _with_interval(
    key: Test,
    found: Any,
    exact: float,
    effect: Callable[[Floats, Floats], float],
    better: Floats,
    than: Floats,
) -> StatisticalTest:
    """Return a test with its effect, and the interval of the BCa bootstrap over participants."""
    low = high = nan
    if np.ptp(better - than):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter(
                "ignore"
            )  # of a degenerate distribution; the interval is then nan
            low, high = stats.bootstrap(
                (better, than), effect, n_resamples=RESAMPLES, paired=True, vectorized=False,
                rng=np.random.default_rng(SEED),
            ).confidence_interval  # fmt: skip
    values = (found.statistic, found.pvalue, exact, effect(better, than), low, high)
    return StatisticalTest(key, *map(float, values))

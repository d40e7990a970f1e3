"""Tests of one hypothesis on the answers of the same people, with exact p values and effects.

Large-sample p values are SciPy's, corrected for ties and for continuity; exact ones count all
signs or swaps of the participants' answers, including midranks (Streitberg & Roehmel 1986).
"""

from collections.abc import Sequence
from math import nan
from typing import NamedTuple

import numpy as np
from scipy import stats

from gazerig.gaze.types import Floats


class StatisticalTest(NamedTuple):
    """The results of one test.

    p: from the statistic's distribution in large samples; exact_p: nan if it was not computed
    effect: matched rank-biserial correlation, Cliff's delta, net share of participants or
        Cramer's V
    """

    key: str
    statistic: float
    p: float
    exact_p: float
    effect: float


def signed_rank_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test the participants' differences: Wilcoxon's signed-rank test, zeros left out."""
    d = better - than
    d = d[d != 0.0]
    found = stats.wilcoxon(d, correction=True, method="asymptotic")
    exact = exact_sign_p(np.sign(d) * stats.rankdata(np.abs(d)))
    effect = matched_correlation(better, than)
    return StatisticalTest("signed_rank", found.statistic, found.pvalue, exact, effect)


def rank_sum_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether answers tend to be higher: Wilcoxon's rank-sum (Mann and Whitney's U).

    The large-sample p value treats both answers of a participant as those of two people; the exact
    one swaps each participant's two answers, and is valid for any dependence between them.
    """
    found = stats.mannwhitneyu(better, than, method="asymptotic")
    ranks = stats.rankdata([better, than]).reshape(2, -1)
    exact = exact_sign_p(ranks[0] - ranks[1])
    effect = dominance(better, than)
    return StatisticalTest("rank_sum", found.statistic, found.pvalue, exact, effect)


def sign_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether more participants lean to one side than to the other: the exact sign test."""
    above, kept = int((better > than).sum()), int((better != than).sum())
    p = stats.binomtest(above, kept).pvalue
    return StatisticalTest("sign", above, p, p, 2.0 * above / kept - 1.0)


def chi_square_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether single answers have one distribution: Pearson's chi-square of the counts.

    Without correction for continuity, and with each answer as another person's.
    """
    table = np.array(
        [[np.sum(side == x) for x in np.union1d(better, than)] for side in (better, than)]
    )
    found = stats.chi2_contingency(table, correction=False)
    effect = float(np.sqrt(found.statistic / table.sum()))
    return StatisticalTest("chi_square", found.statistic, found.pvalue, nan, effect)


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

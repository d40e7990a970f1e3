"""Assumptions of the tests, checked on the data."""

from math import isfinite, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gazerig.features.study.statistics.ranks import exact_rank_sum
from gazerig.gaze.types import Floats

_LEVEL = 0.05
_LEAST_SKEW, _LEAST_NORMAL = 8, 3
_AT_AN_END = 0.5


class AssumptionCheck(NamedTuple):
    """The check of one assumption.

    p: probability of the data under the assumption, nan without a test; fine: whether there is no
        evidence against it
    words: the result, and the consequence of a violated assumption
    """

    assumption: str
    p: float
    fine: bool
    words: str


def difference_checks(
    differences: Floats, better_first: NDArray[np.bool_]
) -> list[AssumptionCheck]:
    """Check the differences of participants: symmetry, normality, and the order of conditions.

    Args:
        differences: (n,) one per participant.
        better_first: (n,) whether the condition expected to be better was seen first.
    """
    d, checks = differences, list[AssumptionCheck]()
    differ = len(d) > 0 and np.ptp(d) > 0.0
    if len(d) >= _LEAST_SKEW and differ:
        p = float(stats.skewtest(d).pvalue)
        words = f"skewness {float(stats.skew(d)):.2f}"
        if p < _LEVEL:
            words += ": the signed-rank test may answer to the skew; see the counts"
        what = "differences are symmetric (signed-rank)"
        checks.append(AssumptionCheck(what, p, p >= _LEVEL, words))
    if len(d) >= _LEAST_NORMAL and differ:
        found = stats.shapiro(d)
        p = float(found.pvalue)
        words = f"Shapiro-Wilk W = {float(found.statistic):.3f}"
        if p < _LEVEL:
            words += ": read d_z as a description; the tests by ranks do not need it"
        checks.append(AssumptionCheck("differences are normal (d_z)", p, p >= _LEVEL, words))
    first, second = d[better_first], d[~better_first]
    what = "the order of the conditions does not matter"
    if not len(first) or not len(second):
        words = "all saw them in one order: it cannot be told apart"
        return [*checks, AssumptionCheck(what, nan, False, words)]
    p = exact_rank_sum(second, first)
    if not isfinite(p):
        p = float(stats.mannwhitneyu(first, second, method="asymptotic").pvalue)
    words = f"mean difference {first.mean():.2f} seen first (n = {len(first)}), " + (
        f"{second.mean():.2f} seen second (n = {len(second)})"
    )
    if p < _LEVEL:
        words += ": the first impression weighs; compare first presentations alone"
    return [*checks, AssumptionCheck(what, p, p >= _LEVEL, words)]


def range_check(ratings: Floats, points: int) -> AssumptionCheck:
    """Check a rating for floor and ceiling effects, which hide differences.

    Args:
        ratings: (n,) at least one.
        points: steps of the rating.
    """
    low, high = float(np.mean(ratings <= 1.0)), float(np.mean(ratings >= points))
    share = max(low, high)
    words = f"{100 * low:.0f} % at the lowest point, {100 * high:.0f} % at the highest"
    if share > _AT_AN_END:
        words += ": differences beyond the end cannot be seen"
    return AssumptionCheck("the scale has room at both ends", nan, share <= _AT_AN_END, words)

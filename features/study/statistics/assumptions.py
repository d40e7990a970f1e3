"""Assumptions of the tests, checked on the data."""

from collections.abc import Iterator
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

    p: of the data under the assumption, nan without a test; fine: no evidence against it
    words: the result, and the consequence if the assumption is violated
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
    return [
        *_symmetry(differences), *_normality(differences), *_order(differences, better_first),
    ]  # fmt: skip


def _symmetry(d: Floats) -> Iterator[AssumptionCheck]:
    """Check the symmetry of the differences: signed ranks assume it."""
    if len(d) < _LEAST_SKEW or np.ptp(d) == 0.0:
        return
    p = float(stats.skewtest(d).pvalue)
    words = f"skewness {float(stats.skew(d)):.2f}"
    if p < _LEVEL:
        words += ": the signed-rank test may answer to the skew; see the counts"
    yield AssumptionCheck("differences are symmetric (signed-rank)", p, p >= _LEVEL, words)


def _normality(d: Floats) -> Iterator[AssumptionCheck]:
    if len(d) < _LEAST_NORMAL or np.ptp(d) == 0.0:
        return
    found = stats.shapiro(d)
    p = float(found.pvalue)
    words = f"Shapiro-Wilk W = {float(found.statistic):.3f}"
    if p < _LEVEL:
        words += ": read d_z as a description; the tests by ranks do not need it"
    yield AssumptionCheck("differences are normal (d_z)", p, p >= _LEVEL, words)


def _order(d: Floats, better_first: NDArray[np.bool_]) -> Iterator[AssumptionCheck]:
    """Check that the order of the conditions makes no difference."""
    first, second = d[better_first], d[~better_first]
    what = "the order of the conditions does not matter"
    if not len(first) or not len(second):
        yield AssumptionCheck(
            what, nan, False, "all saw them in one order: it cannot be told apart"
        )
        return
    p = exact_rank_sum(second, first)
    if not isfinite(p):
        p = float(stats.mannwhitneyu(first, second, method="asymptotic").pvalue)
    words = f"mean difference {first.mean():.2f} seen first (n = {len(first)}), " + (
        f"{second.mean():.2f} seen second (n = {len(second)})"
    )
    if p < _LEVEL:
        words += ": the first impression weighs; compare first presentations alone"
    yield AssumptionCheck(what, p, p >= _LEVEL, words)


def range_check(ratings: Floats, points: int) -> AssumptionCheck:
    """Check whether a rating had room: differences are hidden if most answers are at one end.

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

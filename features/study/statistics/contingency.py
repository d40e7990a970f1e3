"""Counts of answers: Pearson's chi-square of two or more rows, with an exact probability."""

from collections.abc import Sequence
from itertools import pairwise
from math import nan

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from gazerig.features.study.statistics.effects import StatisticalTest, cramers_v, no_effect
from gazerig.gaze.types import Floats

Counts = NDArray[np.int64]
_MOST_TABLES = 200_000
_DRAWS = 9999
_SEED = 20020403
_LEAST_EXPECTED = 5.0


def counts_of(ratings: Floats, points: int) -> Counts:
    """Return the number of answers at each of 1..points, (points,)."""
    return np.bincount(np.asarray(ratings, np.int64), minlength=points + 1)[1 : points + 1]


def chi_square(
    rows: Sequence[Sequence[int] | Counts] | Counts, paired: bool = False
) -> StatisticalTest:
    """Test whether rows of counts come from one distribution: Pearson's chi-square.

    No correction for continuity. Columns without answers are dropped, which is noted. Expected
    counts
    below five are noted, too: then the exact probability is valid, which is that of all tables with
    the same margins, or of 9999 random ones with a fixed seed.

    Args:
        rows: (conditions, points) number of answers at each point.
        paired: the same participants answered in all rows, which the test does not use.

    Raises:
        ValueError: a row is empty, or there are fewer than two.
    """
    table = np.asarray(rows, np.int64)
    if len(table) < 2 or (table.sum(axis=1) == 0).any():
        raise ValueError("a chi-square test needs two rows with answers")
    kept = table[:, table.sum(axis=0) > 0]
    notes = ["the same participants answered in all rows: the test treats them as others"] * paired
    if dropped := table.shape[1] - kept.shape[1]:
        which = ", ".join(str(k + 1) for k in np.flatnonzero(table.sum(axis=0) == 0))
        notes.append(f"{dropped} of {table.shape[1]} columns are empty and dropped ({which})")
    n, first = int(kept.sum()), int(table[0].sum())
    # The least exact probability is that of rows that share no column, two columns in all; for
    # rows of equal length the reversed table is as extreme.
    least = min(1.0, (2.0 if 2 * first == n else 1.0) / float(special.binom(n, first)))
    if kept.shape[1] < 2:
        nothing, same = no_effect("Cramér's V", "V"), (*notes, "all answers are the same")
        return StatisticalTest("chi_square", "χ²", 0.0, nan, 1.0, 1.0, least, n, nothing, same)
    found = stats.chi2_contingency(kept, correction=False)
    if small := int((found.expected_freq < _LEAST_EXPECTED).sum()):
        notes.append(f"{small} of {kept.size} expected counts are below 5: use the exact chance")
    return StatisticalTest(
        "chi_square", "χ²", float(found.statistic), float(found.dof), float(found.pvalue),
        exact_p_value(kept), least, n, cramers_v(float(found.statistic), n, kept.shape), tuple(notes),
    )  # fmt: skip


def exact_p_value(table: Counts) -> float:
    """Return the probability of tables at least as extreme with these margins.

    Tables with a large chi-square are extreme. Up to 200,000 tables of two rows are all enumerated;
    otherwise 9999 tables are drawn.
    """
    columns = table.sum(axis=0)
    if len(table) == 2 and np.prod(np.minimum(columns, table.sum(axis=1).min()) + 1.0) < (
        _MOST_TABLES
    ):
        first, chances = _tables(columns, int(table[0].sum()))
        distances = _distance(first, columns, int(table[0].sum()))
        seen = float(_distance(table[:1], columns, int(table[0].sum()))[0])
        extreme = distances >= seen * (1.0 - 1e-12) - 1e-12
        return min(1.0, float(chances[extreme].sum()))
    drawn = stats.MonteCarloMethod(n_resamples=_DRAWS, rng=np.random.default_rng(_SEED))
    return float(stats.chi2_contingency(table, correction=False, method=drawn).pvalue)


def _tables(columns: Counts, row: int) -> tuple[Counts, Floats]:
    """Return all first rows with these margins, (tables, columns), and their probabilities."""
    partial = np.zeros((1, 0), np.int64)
    left = np.concatenate([np.cumsum(columns[::-1])[::-1], [0]])
    for column, (_, after) in zip(columns, pairwise(left), strict=True):
        each = np.arange(column + 1)
        partial = np.concatenate(
            [np.repeat(partial, len(each), axis=0), np.tile(each, len(partial))[:, None]], axis=1
        )
        so_far = partial.sum(axis=1)
        partial = partial[(so_far <= row) & (so_far + after >= row)]
    log = (
        special.gammaln(columns + 1.0)
        - special.gammaln(partial + 1.0)
        - special.gammaln(columns - partial + 1.0)
    ).sum(axis=1)
    chances = np.exp(log - log.max())
    return partial, chances / chances.sum()


def _distance(first: Counts, columns: Counts, row: int) -> Floats:
    """Return chi-square up to a factor, of first rows (tables, columns) of two."""
    expected = columns * (row / columns.sum())
    distances: Floats = (((first - expected) ** 2) / columns).sum(axis=1)
    return distances

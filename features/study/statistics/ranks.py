"""Rank tests: Wilcoxon's rank-sum and signed-rank, Friedman's, and the sign test.

Probabilities of large samples are SciPy's, corrected for ties and for continuity; exact ones count
the permutations of the observed ranks, including midranks (Streitberg & Roehmel 1986).
"""

from math import factorial, isfinite, nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from gazerig.features.study.statistics import effects
from gazerig.features.study.statistics.effects import EffectSize, StatisticalTest, no_effect
from gazerig.gaze.types import Floats

Zeros = Literal["wilcox", "pratt"]
"""Treatment of zeros: left out (Wilcoxon 1945), or ranked and then left out (Pratt 1959)."""

_MOST_EXACT = 200
_PERMUTATIONS = 9999
_AT_ONCE = 500_000
_SEED = 20020402


def rank_sum_test(
    a: Floats, b: Floats, two_sided: bool = True, paired: bool = False
) -> StatisticalTest:
    """Test whether b tends to exceed a: Wilcoxon's rank-sum, or Mann and Whitney's U.

    Args:
        a: (n,) answers.
        b: (m,) answers.
        two_sided: differences of either sign count.
        paired: the same participants in the same order gave both. The exact probability then swaps
            each participant's two answers, and the effect's interval resamples participants.

    Raises:
        ValueError: one side has no answer.
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    if not len(a) or not len(b):
        raise ValueError("a rank-sum test needs answers on both sides")
    effect = effects.cliffs_delta(a, b, paired)
    ways = 2.0 ** len(a) if paired else float(special.binom(len(a) + len(b), len(a)))
    least = min(1.0, (2 if two_sided else 1) / ways)
    notes = ("the chance of large samples treats both answers as other persons'",) * paired
    if np.ptp(np.concatenate([a, b])) == 0.0:
        same = (*notes, "all answers are the same")
        half = 0.5 * len(a) * len(b)
        return StatisticalTest("rank_sum", "U", half, nan, 1.0, 1.0, least, len(a), effect, same)
    found = stats.mannwhitneyu(b, a, alternative=_side(two_sided), method="asymptotic")
    exact, p = (exact_swaps if paired else exact_rank_sum)(a, b, two_sided), float(found.pvalue)
    if paired and not isfinite(exact):  # enough that the swaps' sum is normal
        scores = _swap_scores(a, b).astype(float)
        z = float(scores.sum() / np.sqrt((scores**2).sum()))
        p = float(2.0 * stats.norm.sf(abs(z)) if two_sided else stats.norm.sf(z))
        notes = ("the chance of large samples is that of all swaps",)
    return StatisticalTest(
        "rank_sum", "U", float(found.statistic), nan, p, exact, least,
        len(a) if paired else len(a) + len(b), effect, notes,
    )  # fmt: skip


def exact_rank_sum(a: Floats, b: Floats, two_sided: bool = True) -> float:
    """Return the share of all divisions of the answers that are as extreme as this one.

    Two-sided: as far from the mean rank sum, on either side. nan for more than 200 answers.
    """
    whole = np.concatenate([a, b])
    if len(whole) > _MOST_EXACT:
        return nan
    doubled = np.rint(2.0 * stats.rankdata(whole)).astype(np.int64)
    seen, m = int(doubled[len(a) :].sum()), len(b)
    ways = np.zeros((m + 1, int(doubled.sum()) + 1))
    ways[0, 0] = 1.0
    for rank in doubled:
        ways[1:, rank:] += ways[:-1, : ways.shape[1] - rank].copy()
    chances = ways[m] / ways[m].sum()
    if not two_sided:
        return float(min(1.0, chances[seen:].sum()))
    sums = np.arange(len(chances))
    centre = m * (len(whole) + 1)
    return float(min(1.0, chances[np.abs(sums - centre) >= abs(seen - centre)].sum()))


def exact_swaps(a: Floats, b: Floats, two_sided: bool = True) -> float:
    """Return the share of all swaps of participants' answers with as extreme a rank sum.

    It is valid for any dependence between the two answers of a participant.

    Args:
        a: (n,) answers, one per participant.
        b: (n,) other answers of the same participants.
        two_sided: differences of either sign count.
    """
    return _all_signs(_swap_scores(a, b), two_sided)


def _swap_scores(a: Floats, b: Floats) -> NDArray[np.int64]:
    """Return the change of the doubled rank sum by each participant's swap, (n,)."""
    doubled = np.rint(2.0 * stats.rankdata(np.concatenate([a, b]))).astype(np.int64)
    found: NDArray[np.int64] = doubled[len(a) :] - doubled[: len(a)]
    return found


def signed_rank_test(
    differences: Floats, two_sided: bool = True, zeros: Zeros = "wilcox"
) -> StatisticalTest:
    """Test whether differences are centred at zero: Wilcoxon's signed-rank test.

    Args:
        differences: (n,) one per participant.
        two_sided: differences of either sign count.
        zeros: treatment of differences of zero.
    """
    d = np.asarray(differences, float)
    kept = int(np.count_nonzero(d))
    notes: tuple[str, ...] = ()
    if kept < len(d):
        done = "left out (Wilcoxon)" if zeros == "wilcox" else "ranked, then left out (Pratt)"
        notes = (f"{len(d) - kept} of {len(d)} differences are zero and are {done}",)
    least = min(1.0, (2.0 if two_sided else 1.0) * 0.5 ** len(d))
    if not kept:
        nothing = no_effect("matched rank-biserial correlation", "r")
        same = (*notes, "no participant answered differently")
        return StatisticalTest("signed_rank", "T", 0.0, nan, 1.0, 1.0, least, len(d), nothing, same)
    found = stats.wilcoxon(
        d, zero_method=zeros, correction=True, alternative=_side(two_sided), method="asymptotic"
    )
    return StatisticalTest(
        "signed_rank", "T", float(found.statistic), nan, float(found.pvalue),
        exact_signed_rank(d, two_sided, zeros), least, len(d), effects.rank_biserial(d), notes,
    )  # fmt: skip


def exact_signed_rank(
    differences: Floats, two_sided: bool = True, zeros: Zeros = "wilcox"
) -> float:
    """Return the share of all signs of the differences that are as extreme as these.

    nan for more than 200 nonzero differences.
    """
    d = np.asarray(differences, float)
    if zeros == "wilcox":
        d = d[d != 0.0]
    ranks = np.rint(2.0 * stats.rankdata(np.abs(d))).astype(np.int64)
    return _all_signs(np.sign(d).astype(np.int64) * ranks, two_sided)


def _all_signs(scores: NDArray[np.int64], two_sided: bool) -> float:
    """Return the share of all signs of scores (n,) with as extreme a sum; nan above 200."""
    scores = scores[scores != 0]
    if len(scores) > _MOST_EXACT:
        return nan
    sizes = np.abs(scores)
    chances = np.zeros(int(sizes.sum()) + 1)
    chances[0] = 1.0
    for size in sizes:
        moved = np.zeros_like(chances)
        moved[size:] = chances[: len(chances) - size]
        chances = 0.5 * (chances + moved)
    seen = int(sizes[scores > 0].sum())
    above, below = float(chances[seen:].sum()), float(chances[: seen + 1].sum())
    return min(1.0, 2.0 * min(above, below) if two_sided else above)


def sign_test(differences: Floats, two_sided: bool = True) -> StatisticalTest:
    """Test whether more participants prefer one side than the other: the exact sign test.

    A participant counts once, regardless of the number of choices.

    Args:
        differences: (n,) one per participant; only their signs are used.
        two_sided: differences of either sign count.
    """
    d = np.asarray(differences, float)
    above, kept = int(np.count_nonzero(d > 0.0)), int(np.count_nonzero(d))
    notes: tuple[str, ...] = ()
    if kept < len(d):
        notes = (f"{len(d) - kept} of {len(d)} participants lean to neither side: left out",)
    least = min(1.0, (2.0 if two_sided else 1.0) * 0.5 ** len(d))
    name, symbol = "net share of participants", "Δ"
    if not kept:
        nothing = no_effect(name, symbol)
        return StatisticalTest("sign", "K", 0.0, nan, 1.0, 1.0, least, len(d), nothing, notes)
    p = float(stats.binomtest(above, kept, alternative=_side(two_sided)).pvalue)
    low, high = stats.binomtest(above, kept).proportion_ci(0.95)
    effect = EffectSize(
        name, symbol, 2.0 * above / kept - 1.0, 2.0 * float(low) - 1.0, 2.0 * float(high) - 1.0,
        "Clopper-Pearson",
    )  # fmt: skip
    return StatisticalTest("sign", "K", above, nan, p, p, least, len(d), effect, notes)


def friedman_test(rows: Floats) -> StatisticalTest:
    """Test whether conditions differ: Friedman's test, with ties.

    The exact probability is that of all orders of the answers within participants, or of 9999
    orders drawn with a fixed seed if there are more.

    Args:
        rows: (participants, conditions), three conditions or more.

    Raises:
        ValueError: fewer than three conditions.
    """
    rows = np.asarray(rows, float)
    n, k = rows.shape
    if k < 3:
        raise ValueError(f"Friedman's test compares three conditions or more, not {k}")
    effect = effects.kendalls_w(rows)
    least = max(1.0 / (_PERMUTATIONS + 1), float(factorial(k)) ** -(n - 1))
    if not np.ptp(rows, axis=1).any():
        same = ("every participant answered alike everywhere",)
        return StatisticalTest("friedman", "χ²", 0.0, k - 1, 1.0, 1.0, least, n, effect, same)
    found = stats.friedmanchisquare(*rows.T)

    def agreement(*columns: Floats, axis: int) -> Floats:
        """Return the sum of the squared rank sums."""
        squares: Floats = (np.sum(columns, axis=axis) ** 2).sum(axis=0)
        return squares

    exact = stats.permutation_test(
        stats.rankdata(rows, axis=1).T, agreement, permutation_type="samples", vectorized=True,
        n_resamples=_PERMUTATIONS, batch=max(1, _AT_ONCE // rows.size), alternative="greater",
        rng=np.random.default_rng(_SEED),
    )  # fmt: skip
    return StatisticalTest(
        "friedman", "χ²", float(found.statistic), k - 1, float(found.pvalue), float(exact.pvalue),
        least, n, effect,
    )  # fmt: skip


def _side(two_sided: bool) -> str:
    return "two-sided" if two_sided else "greater"

"""Sample size of a study: power of its tests under the model of answers.

A closed formula for the signed-rank test (the paired t test's over the asymptotic relative
efficiency 3/pi; Lehmann, Nonparametrics, 1975, ch. 4) assumes continuous answers. Five points have
ties, which reduce power, so power is simulated: studies are drawn from the simulated participants'
model of answers (gazerig.features.study.simulation) and tested, 5 000 for each number of
participants, with a fixed seed. The formula is the start of the search, and is shown as well.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gazerig.features.study.design import Hypothesis, StudyDesign, Test
from gazerig.features.study.scores import Measure
from gazerig.features.study.simulation import (
    BETWEEN_SD,
    ITEM_SD,
    TRIAL_SD,
    choice_probability,
    effect_shift,
    thresholds,
)  # fmt: skip
from gazerig.features.study.trial_order import balanced_group_size
from gazerig.gaze.types import Floats

MOST = 2000
"""Largest number of participants in the search."""
_STUDIES = 5_000
_SEED = 20_020_405
_EXACT = 40
"""Largest number of differences with an exact test, as in the analysis."""
_ROUGH, _CLEAR = 12, 8.0
"""With more than ``_ROUGH`` differences, exact p values are within a factor of 3 of approximate
ones (found over designs of 2 to 7 points and alpha of .05 to .001), so that one ``_CLEAR`` times
above or below alpha decides."""
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(61)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()

Counts = NDArray[np.int64]


@dataclass(frozen=True)
class PowerQuestion:
    """A test and the effect that it must detect.

    Attributes:
        test: The deciding test.
        effect: d_z of a participant's differences, as they are analysed.
        alpha: Of this one test.
        two_sided: Whether differences of either sign count.
        points: Steps of the rating; 0 for continuous measures, such as, nearly, means of scales.
        choices: Direct choices between both conditions per participant, for tests of choices.
    """

    test: Test
    effect: float
    alpha: float
    two_sided: bool = True
    points: int = 5
    choices: int = 1


class PowerClaim(NamedTuple):
    """Power and sample size of a hypothesis.

    power: with the planned participants; formula: participants by the closed formula
    needed: participants for the required power, a multiple of the orders; None above ``MOST``
    """

    question: PowerQuestion
    participants: int
    power: float
    formula: int
    needed: int | None


def power_claim(design: StudyDesign, hypothesis: Hypothesis, measure: Measure) -> PowerClaim:
    """Return the power of a hypothesis' own test, and the participants that it needs.

    With a correction for several hypotheses each gets its share of alpha; Holm's procedure only
    increases the power.
    """
    many = len(design.hypotheses) if design.plan.correction != "none" else 1
    repetitions = design.trials.repetitions
    sides = (*design.side(hypothesis.better), *design.side(hypothesis.than))
    whole = measure.kind == "item" and repetitions == 1 and len(sides) == 2
    asked = PowerQuestion(
        hypothesis.test,
        design.plan.effect,
        design.plan.alpha / many,
        hypothesis.two_sided,
        measure.points if whole else 0,
        repetitions,
    )
    n, wanted = design.plan.participants, design.plan.power
    return PowerClaim(
        asked, n, power_of(asked, n), sample_size_by_formula(asked, wanted),
        sample_size(asked, wanted, balanced_group_size(design)),
    )  # fmt: skip


def sample_size_by_formula(asked: PowerQuestion, power: float) -> int:
    """Return the participants by the normal approximation, without ties.

    n = ((z_alpha + z_power) / d)^2, for rank tests divided by 3/pi; for choices that of the sign
    test.
    """
    sides = 2 if asked.two_sided else 1
    z_null, z_power = float(stats.norm.isf(asked.alpha / sides)), float(stats.norm.ppf(power))
    if asked.test == "sign":
        above, below = _preference_probabilities(asked)
        mean, lean = above - below, above + below
        return ceil(((z_null * sqrt(lean) + z_power * sqrt(lean - mean**2)) / mean) ** 2)
    return ceil(((z_null + z_power) / asked.effect) ** 2 * pi / 3.0)


def sample_size(asked: PowerQuestion, power: float, multiple: int = 1) -> int | None:
    """Return the smallest number of participants for a power, None above ``MOST``."""
    low, high = 0, ceil(sample_size_by_formula(asked, power) / multiple)
    if high * multiple > MOST:  # ties only increase it
        return None
    while power_of(asked, high * multiple) < power:
        low, high = high, ceil(1.3 * high) + 1
        if low * multiple >= MOST:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        if power_of(asked, middle * multiple) < power:
            low = middle
        else:
            high = middle
    return high * multiple


@lru_cache(maxsize=4096)
def power_of(asked: PowerQuestion, n: int) -> float:
    """Return the probability that a deciding test of ``n`` participants is significant."""
    if n < 1:
        return 0.0
    if asked.test == "sign":
        return _sign_test_power(asked, n)
    rng = np.random.default_rng((_SEED, n))
    if asked.test == "rank_sum":
        return _rank_sum_power(asked, n, rng)
    return _signed_rank_power(asked, n, rng)


@lru_cache(maxsize=64)
def joint_probabilities(effect: float, points: int) -> Floats:
    """Return the joint probabilities of a participant's two ratings, (points, points).

    Rows are the rating of the condition expected to be better, columns of the other one.
    """
    shift, noise = effect_shift(effect, points), sqrt(TRIAL_SD**2 + ITEM_SD**2)
    ends = np.array([-np.inf, *thresholds(points), np.inf])
    own = BETWEEN_SD * _NODES[:, None]
    above, below = (
        np.diff(stats.norm.cdf((ends - own - side * shift) / noise), axis=1) for side in (0.5, -0.5)
    )
    found: Floats = np.einsum("k,ki,kj->ij", _WEIGHTS, above, below)
    return found


def _draw_ratings(asked: PowerQuestion, n: int, rng: np.random.Generator) -> Counts:
    """Return the number of participants with each pair of ratings, (studies, points, points)."""
    cells = joint_probabilities(asked.effect, asked.points)
    found: Counts = rng.multinomial(n, (cells / cells.sum()).ravel(), _STUDIES)
    return found.reshape(_STUDIES, asked.points, asked.points)


def _signed_rank_power(asked: PowerQuestion, n: int, rng: np.random.Generator) -> float:
    """Return the power of Wilcoxon's signed-rank test, zeros left out."""
    if asked.points:
        drawn = _draw_ratings(asked, n, rng)
        reach = range(1, asked.points)
        up = np.stack([np.trace(drawn, -k, 1, 2) for k in reach], axis=1)
        down = np.stack([np.trace(drawn, k, 1, 2) for k in reach], axis=1)
    else:  # all differ: each participant is a column, in the order of the differences
        d = rng.normal(asked.effect, 1.0, (_STUDIES, n))
        sign = np.take_along_axis(d, np.argsort(np.abs(d), axis=1), axis=1) > 0.0
        up, down = sign.astype(np.int64), (~sign).astype(np.int64)
    size = up + down
    doubled = 2 * np.cumsum(size, axis=1) - size + 1  # twice the midrank of each size
    above, below = (np.sum(doubled * one, axis=1) for one in (up, down))
    alpha = asked.alpha / (2.0 if asked.two_sided else 1.0)
    kept = size.sum(axis=1)
    # W+ minus its mean is half of (above - below) in doubled ranks; its variance sums their
    # squares.
    spread = np.sqrt(np.sum(size * doubled.astype(float) ** 2, axis=1))
    z = (np.abs(above - below) - 2.0) / np.maximum(spread, 1e-12)
    p = stats.norm.sf(z)
    found: NDArray[np.bool_] = p <= alpha
    is_open = (kept <= _ROUGH) | ((p > alpha / _CLEAR) & (p < alpha * _CLEAR))
    few = np.flatnonzero(is_open & (kept <= _EXACT))
    if len(few):
        patterns, which = np.unique(size[few], axis=0, return_inverse=True)
        sizes = [tuple(filter(None, row)) for row in patterns.tolist()]
        least = np.array([_critical_rank_sum(one, alpha) for one in sizes])
        found[few] = np.maximum(above, below)[few] >= least[which.ravel()]
    return float((found if asked.two_sided else found & (above > below)).mean())


@lru_cache(maxsize=200_000)
def _critical_rank_sum(size: tuple[int, ...], alpha: float) -> int:
    """Return the smallest doubled sum of ranks on one side with exact probability up to alpha.

    size: numbers of equal differences by ascending size, all above 0; all signs are equally likely
    """
    chances, before = np.ones(1), 0
    for many in size:
        step = 2 * before + many + 1
        spaced = np.zeros(many * step + 1)
        spaced[::step] = _sign_chances(many)
        chances, before = np.convolve(chances, spaced), before + many
    tail = np.cumsum(chances[::-1])[::-1]
    return int(np.searchsorted(-tail, -alpha * (1.0 + 1e-9)))


@lru_cache(maxsize=4096)
def _sign_chances(many: int) -> Floats:
    """Return the probability of each number of positive signs among so many."""
    chances: Floats = stats.binom.pmf(np.arange(many + 1), many, 0.5)
    return chances


def _rank_sum_power(asked: PowerQuestion, n: int, rng: np.random.Generator) -> float:
    """Return the power of the rank-sum test of the same participants' answers, by their swaps."""
    if asked.points:
        drawn = _draw_ratings(asked, n, rng)
        size = drawn.sum(axis=2) + drawn.sum(axis=1)
        midrank = np.cumsum(size, axis=1) - 0.5 * (size - 1)
        scores = midrank[:, :, None] - midrank[:, None, :]
        total, spread = (np.sum(drawn * one, axis=(1, 2)) for one in (scores, scores**2))
    else:
        own = BETWEEN_SD**2 / (BETWEEN_SD**2 + TRIAL_SD**2 + ITEM_SD**2)
        shift = asked.effect * sqrt(2.0 * (1.0 - own))
        person = sqrt(own) * rng.normal(size=(_STUDIES, n))
        both = [person + sqrt(1.0 - own) * rng.normal(size=(_STUDIES, n)) for _ in range(2)]
        ranks = stats.rankdata(np.concatenate([both[0] + shift, both[1]], axis=1), axis=1)
        scores = ranks[:, :n] - ranks[:, n:]
        total, spread = (np.sum(one, axis=1) for one in (scores, scores**2))
    z = (np.abs(total) - 0.5) / np.sqrt(np.maximum(spread, 1e-12))
    alpha = asked.alpha / (2.0 if asked.two_sided else 1.0)
    found = stats.norm.sf(z) <= alpha
    return float(np.mean(found if asked.two_sided else found & (total > 0.0)))


def _preference_probabilities(asked: PowerQuestion) -> tuple[float, float]:
    """Return the probabilities that a participant prefers the better condition and the other."""
    chances = stats.binom.pmf(
        np.arange(asked.choices + 1), asked.choices, choice_probability(asked.effect)
    )
    half = 0.5 * asked.choices
    at = np.arange(asked.choices + 1)
    return float(chances[at > half].sum()), float(chances[at < half].sum())


def _sign_test_power(asked: PowerQuestion, n: int) -> float:
    """Return the power of the exact sign test of participants' choices."""
    alpha = asked.alpha / (2.0 if asked.two_sided else 1.0)
    above, below = _preference_probabilities(asked)
    kept = np.arange(n + 1)
    share = above / (above + below)
    # Without an effect, more than this number above has a probability of at most alpha.
    most = stats.binom.isf(alpha, kept, 0.5)
    found = stats.binom.sf(most, kept, share)
    if asked.two_sided:
        found = found + stats.binom.cdf(kept - most - 1, kept, share)
    return float(stats.binom.pmf(kept, n, above + below) @ found)

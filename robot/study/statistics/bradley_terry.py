"""Choices between pairs as one scale: the model of Bradley & Terry (1952), by maximum likelihood.

P(i chosen over j) = 1 / (1 + exp(-(s_i - s_j))); the scores s add up to zero. Ties are no answers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb, inf, nan

import numpy as np
from numpy.typing import NDArray
from scipy import sparse, special, stats
from scipy.sparse import csgraph

from gazerig.gaze.types import Floats
from gazerig.robot.study.statistics.results import EffectSize, StatisticalTest

_Z95 = float(stats.norm.ppf(0.975))
_STEPS = 100
_SMALL = 1e-10


@dataclass(frozen=True)
class BradleyTerryFit:
    """Scores of conditions on one scale.

    scores: (k,) in logits, sum 0; covariance: (k, k)
    fault: why there are none, "" where there are
    """

    scores: Floats
    covariance: Floats
    log_likelihood: float
    fault: str = ""

    def intervals(self) -> Floats:
        """Return the 95 % Wald intervals of the scores, (k, 2)."""
        half = _Z95 * np.sqrt(np.diag(self.covariance))
        return np.stack([self.scores - half, self.scores + half], axis=1)

    def difference(self, first: int, second: int) -> tuple[float, float]:
        """Return by how much the first lies above the second, and the standard error."""
        contrast = np.zeros(len(self.scores))
        contrast[first], contrast[second] = 1.0, -1.0
        variance = float(contrast @ self.covariance @ contrast)
        return float(contrast @ self.scores), float(np.sqrt(variance))


def fit(wins: NDArray[np.int64], names: Sequence[str] = ()) -> BradleyTerryFit:
    """Fit scores to choices.

    There are finite scores only where no group of conditions was always chosen over all others, nor
    was never compared with them (Ford 1957); else ``fault`` says which.

    Args:
        wins: (k, k) how often the row was chosen over the column.
        names: of the rows, for the fault; numbers from 1 without.
    """
    k = len(wins)
    if fault := disconnected(wins, names):
        return BradleyTerryFit(np.full(k, nan), np.full((k, k), nan), nan, fault)
    shown = wins + wins.T
    scores = np.zeros(k)
    for _ in range(_STEPS):
        chance = special.expit(scores[:, None] - scores[None, :])
        slope = (wins - shown * chance).sum(axis=1)
        step = np.linalg.pinv(_information(shown, chance)) @ slope
        # A long step may overshoot where choices are nearly all alike.
        scores = scores + step * min(1.0, 2.0 / max(_SMALL, float(np.abs(step).max())))
        if float(np.abs(step).max()) < _SMALL:
            break
    chance = special.expit(scores[:, None] - scores[None, :])
    likelihood = float((wins * np.log(np.where(wins > 0, chance, 1.0))).sum())
    covariance = np.asarray(np.linalg.pinv(_information(shown, chance)), np.float64)
    return BradleyTerryFit(scores - scores.mean(), covariance, likelihood)


def _information(shown: NDArray[np.int64], chance: Floats) -> Floats:
    """Return Fisher's information of the scores; it knows nothing of their mean."""
    weights = shown * chance * (1.0 - chance)
    return np.diag(weights.sum(axis=1)) - weights


def disconnected(wins: NDArray[np.int64], names: Sequence[str] = ()) -> str:
    """Return why choices allow no finite scores, "" where they do."""
    if not (wins + wins.T).any():
        return "nothing was chosen"
    edges = sparse.csr_matrix(wins > 0)
    together, _ = csgraph.connected_components(edges, directed=True, connection="weak")
    if together > 1:
        return "some conditions were never compared with the others, not even through a third"
    strong, of = csgraph.connected_components(edges, directed=True, connection="strong")
    if strong == 1:
        return ""
    never = [k for k in range(len(wins)) if not wins[np.ix_(of != of[k], of == of[k])].any()]
    which = " and ".join(names[k] if names else f"condition {k + 1}" for k in never)
    return f"{which} was chosen always over others: no finite score fits"


def preferred(
    wins: NDArray[np.int64], better: int, than: int, two_sided: bool, names: Sequence[str] = ()
) -> StatisticalTest:
    """Test whether one condition is chosen over another, by all choices there are.

    The statistic is the likelihood ratio of equal scores; exact is the binomial chance of the
    direct choices between both. Choices count as independent of each other.

    Args:
        wins: (k, k) how often the row was chosen over the column.
        better: row of the condition expected above.
        than: row of the other.
        two_sided: either sign counts.
        names: of the rows, for notes.
    """
    won, lost = int(wins[better, than]), int(wins[than, better])
    direct = won + lost
    exact = nan
    if direct:
        side = "two-sided" if two_sided else "greater"
        exact = float(stats.binomtest(won, direct, 0.5, alternative=side).pvalue)
    least = min(1.0, (2.0 if two_sided else 1.0) * 0.5**direct) if direct else 1.0
    found = fit(wins, names)
    notes = (f"{won} of {direct} direct choices", "choices count as independent of each other")
    if found.fault:
        effect = EffectSize("difference of scores", "Δs", nan, nan, nan, "none", bounded=False)
        return StatisticalTest(
            "bradley_terry", "χ²", nan, 1.0, nan, exact, least, direct, effect,
            (*notes, found.fault),
        )  # fmt: skip
    difference, error = found.difference(better, than)
    ratio = max(0.0, 2.0 * (found.log_likelihood - _equal(wins, better, than)))
    p = float(stats.chi2.sf(ratio, 1))
    if not two_sided:
        p = 0.5 * p if difference > 0.0 else 1.0 - 0.5 * p
    effect = EffectSize(
        "difference of scores", "Δs", difference, difference - _Z95 * error,
        difference + _Z95 * error, "Wald", bounded=False,
    )  # fmt: skip
    # With three conditions or more, choices against third ones say something too.
    alone = len(wins) == 2
    return StatisticalTest(
        "bradley_terry", "χ²", ratio, 1.0, p, exact if alone else nan, least, direct, effect, notes
    )


def _equal(wins: NDArray[np.int64], a: int, b: int) -> float:
    """Return the log-likelihood of the best fit in which two conditions have one score."""
    direct = int(wins[a, b] + wins[b, a])
    kept = [k for k in range(len(wins)) if k != b]
    merged = wins.astype(np.int64).copy()
    merged[a] += merged[b]
    merged[:, a] += merged[:, b]
    merged[a, a] = 0
    rest = merged[np.ix_(kept, kept)]
    even = -direct * float(np.log(2.0))
    if len(rest) == 1 or not rest.any():
        return even
    found = fit(rest)
    return -inf if found.fault else found.log_likelihood + even


def circular_triples(wins: NDArray[np.int64]) -> tuple[int, int]:
    """Return how many triples of conditions go in a circle by majority, and how many there are."""
    majority = wins > wins.T
    k = len(wins)
    circles = int(np.trace(np.linalg.matrix_power(majority.astype(np.int64), 3))) // 3
    return circles, comb(k, 3)

"""Ratings with a random intercept for each participant: the cumulative-link mixed model.

P(y <= k) = F(theta_k - x beta - sigma v), F logistic, v standard normal for each participant
(Hedeker & Gibbons 1994). The integral over v is adaptive Gauss-Hermite quadrature about its mode
(Liu & Pierce 1994); one node is Laplace's approximation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special, stats

from gazerig.gaze.types import Floats
from gazerig.robot.study.statistics.results import EffectSize, StatisticalTest

NODES = 11
_Z95 = float(stats.norm.ppf(0.975))
_NEWTON_STEPS, _NEWTON_DONE = 60, 1e-9
_STEP = 1e-4
_SEPARATED = 12.0
"""Logits beyond which an effect is taken for infinite: every answer lies on one side."""

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class OrdinalFit:
    """A fitted model.

    thresholds: (points - 1,) between the points that were answered, ascending
    effects: (p,) of the columns of x, in logits; spread: standard deviation of the participants
    covariance: of thresholds, effects and spread, by the curvature of the likelihood
    """

    thresholds: Floats
    effects: Floats
    spread: float
    covariance: Floats
    log_likelihood: float
    converged: bool

    def standard_error(self, effect: int) -> float:
        """Return the standard error of an effect, nan where the likelihood is flat."""
        variance = float(self.covariance[len(self.thresholds) + effect][
            len(self.thresholds) + effect])  # fmt: skip
        return sqrt(variance) if variance > 0.0 else nan


def fit(ratings: Indices, x: Floats, participants: Indices, nodes: int = NODES) -> OrdinalFit:
    """Fit the model by maximum likelihood.

    Args:
        ratings: (n,) whole numbers; points that nobody chose take no part.
        x: (n, p) what may shift the ratings; p may be 0.
        participants: (n,) who answered, any numbers.
        nodes: of the quadrature.

    Raises:
        ValueError: all ratings are the same.
    """
    _, y = np.unique(ratings, return_inverse=True)
    _, group = np.unique(participants, return_inverse=True)
    points = int(y.max()) + 1
    if points < 2:
        raise ValueError("all ratings are the same: there is nothing to fit")
    likelihood = _Likelihood(y, np.asarray(x, float), group, nodes)
    shares = np.cumsum(np.bincount(y))[:-1] / len(y)
    thresholds = special.logit(shares)
    start = np.concatenate(
        [thresholds[:1], np.log(np.diff(thresholds)), np.zeros(x.shape[1]), [1.0]]
    )
    found = optimize.minimize(
        lambda free: -likelihood.of(_natural(free, points)), start, method="BFGS",
        jac="3-point", options={"gtol": 1e-5},
    )  # fmt: skip
    best = _natural(found.x, points)
    # The likelihood knows the spread only up to its sign.
    best[-1] = abs(best[-1])
    curvature = _curvature(lambda at: -likelihood.of(at), best)
    covariance = np.asarray(np.linalg.pinv(curvature), np.float64)
    flat = bool(np.abs(found.jac).max() < 0.05)
    return OrdinalFit(
        best[: points - 1], best[points - 1 : -1], float(best[-1]), covariance, -float(found.fun),
        bool(found.success) or flat,
    )  # fmt: skip


class _Likelihood:
    """The likelihood of ratings, marginal over participants."""

    def __init__(self, y: Indices, x: Floats, group: Indices, nodes: int) -> None:
        """Keep the data; y and group count from 0."""
        self._y, self._x, self._group = y, x, group
        self._groups = int(group.max()) + 1
        self._nodes, self._weights = np.polynomial.hermite.hermgauss(nodes)

    def of(self, parameters: Floats) -> float:
        """Return the log-likelihood of thresholds, effects and spread in one array."""
        p = self._x.shape[1]
        thresholds, spread = parameters[: -p - 1], float(parameters[-1])
        shift = self._x @ parameters[len(thresholds) : -1]
        edges = np.concatenate([[-np.inf], thresholds, [np.inf]])
        high, low = edges[self._y + 1] - shift, edges[self._y] - shift
        modes, curvature = self._mode(high, low, spread)
        scale = np.sqrt(2.0 / curvature)
        v = modes[:, None] + scale[:, None] * self._nodes
        moved = spread * v[self._group]
        chance = special.expit(high[:, None] - moved) - special.expit(low[:, None] - moved)
        logs = np.log(np.maximum(chance, 1e-300))
        joint = _summed(logs, self._group, self._groups) - 0.5 * v**2 + self._nodes**2
        each = special.logsumexp(joint + np.log(self._weights), axis=1)
        return float((each + np.log(scale) - 0.5 * np.log(2.0 * pi)).sum())

    def _mode(self, high: Floats, low: Floats, spread: float) -> tuple[Floats, Floats]:
        """Return each participant's most likely v, and the curvature there, by Newton's steps."""
        v = np.zeros(self._groups)
        longest, curvature = 1.0 / max(1.0, abs(spread)), np.ones(self._groups)
        for _ in range(_NEWTON_STEPS):
            moved = spread * v[self._group]
            above, below = special.expit(high - moved), special.expit(low - moved)
            slope = spread * np.bincount(self._group, above + below - 1.0, self._groups) - v
            bend = above * (1.0 - above) + below * (1.0 - below)
            summed = np.bincount(self._group, bend, self._groups)
            curvature = np.asarray(1.0 + spread**2 * summed, np.float64)
            # Beyond a logit the curvature is another; whole steps may swing for ever.
            step = np.clip(slope / curvature, -longest, longest)
            v = v + step
            if float(np.abs(step).max()) < _NEWTON_DONE:
                break
        return v, curvature


def _summed(rows: Floats, group: Indices, groups: int) -> Floats:
    """Return the sums of rows (n, k) of each group, (groups, k)."""
    out = np.zeros((groups, rows.shape[1]))
    np.add.at(out, group, rows)
    return out


def _natural(free: Floats, points: int) -> Floats:
    """Return thresholds in place of the first and the logarithms of their distances."""
    steps = np.exp(np.clip(free[1 : points - 1], -30.0, 30.0))
    thresholds = free[0] + np.concatenate([[0.0], np.cumsum(steps)])
    return np.concatenate([thresholds, free[points - 1 :]])


def _curvature(value: Callable[[Floats], float], at: Floats) -> Floats:
    """Return the matrix of second derivatives by central differences."""
    k = len(at)
    steps = _STEP * np.maximum(1.0, np.abs(at)) * np.eye(k)
    out = np.zeros((k, k))
    for i in range(k):
        for j in range(i, k):
            a, b = steps[i], steps[j]
            bend = value(at + a + b) - value(at + a - b) - value(at - a + b) + value(at - a - b)
            out[i, j] = out[j, i] = bend / (4.0 * a[i] * b[j])
    return out


def ordinal_mixed(
    ratings: Indices, is_better: NDArray[np.bool_], participants: Indices, two_sided: bool
) -> StatisticalTest:
    """Test whether ratings of one condition are higher, by the likelihood ratio.

    Args:
        ratings: (n,) all answers to one item in both conditions.
        is_better: (n,) the answer is on the condition for which more is expected.
        participants: (n,) who gave it.
        two_sided: either sign counts.
    """
    name = "log odds ratio"
    n = len(np.unique(participants))
    least = min(1.0, (2.0 if two_sided else 1.0) * 0.5**n)
    nothing = EffectSize(name, "β", nan, nan, nan, "none", bounded=False)

    def none(p: float, why: str) -> StatisticalTest:
        return StatisticalTest("ordinal_mixed", "χ²", nan, 1.0, p, nan, least, n, nothing, (why,))

    if len(np.unique(ratings)) < 2:
        return none(1.0, "all answers are the same")
    if n < 2:
        return none(nan, "one participant alone has no spread between participants")
    full = fit(ratings, is_better[:, None].astype(float), participants)
    without = fit(ratings, np.zeros((len(ratings), 0)), participants)
    beta, error = float(full.effects[0]), full.standard_error(0)
    ratio = max(0.0, 2.0 * (full.log_likelihood - without.log_likelihood))
    p = float(stats.chi2.sf(ratio, 1))
    if not two_sided:
        p = 0.5 * p if beta > 0.0 else 1.0 - 0.5 * p
    notes = [f"spread between participants {full.spread:.2f} logits"]
    low, high, method = beta - _Z95 * error, beta + _Z95 * error, "Wald"
    if abs(beta) > _SEPARATED or not isfinite(error):
        notes.append("the answers separate the conditions completely: the effect has no finite fit")
        low, high, method = nan, nan, "none"
    if not (full.converged and without.converged):
        notes.append("the fit did not converge: do not rely on it")
    effect = EffectSize(name, "β", beta, low, high, method, bounded=False)
    return StatisticalTest(
        "ordinal_mixed", "χ²", ratio, 1.0, p, nan, least, n, effect, tuple(notes)
    )

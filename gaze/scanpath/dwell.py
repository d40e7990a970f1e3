"""Dwell times: four laws for a measured mean and standard deviation.

Nakamoto & Tsuruno (3.2.3) take "mean +- SD" as the dwell time, but in their table 1 every SD is
above its mean, so that the interval reaches negative times. Each law treats that differently:

lognormal, gamma   positive, with exactly that mean and SD
truncated_normal   a normal law cut off at 0. Its SD is always below its mean; if the measured
                   one is not, the nearest such law is the exponential one, with the same
                   mean and an SD equal to it
uniform            evenly between mean - SD and mean + SD, an interval that is cut off at 0:
                   if SD > mean, the mean drawn is (mean + SD) / 2
"""

from collections.abc import Callable
from math import erfc, exp, log, pi, sqrt
from statistics import NormalDist

import numpy as np

Draw = Callable[[np.random.Generator], float]
"""Function that draws one dwell time in seconds, above 0."""

LAWS = ("lognormal", "gamma", "truncated_normal", "uniform")

_NORMAL = NormalDist()
# Cuts between which a truncated normal law is searched, in its own SDs from its own mean:
# coefficients of variation from 1/30, with a negligible cut, to .998.
_LEAST_CUT, _MOST_CUT = -30.0, 20.0


def dwell_distribution(law: str, mean_s: float, sd_s: float) -> Draw:
    """Return the function that draws dwell times of a law named in ``LAWS``.

    Raises:
        ValueError: no law has that name.
    """
    makers = {
        "lognormal": _lognormal,
        "gamma": _gamma,
        "truncated_normal": _truncated_normal,
        "uniform": _uniform,
    }
    if law not in makers:
        raise ValueError(f"no dwell law {law!r}; there are {', '.join(LAWS)}")
    if sd_s == 0.0:
        return lambda rng: mean_s
    return makers[law](mean_s, sd_s)


def _lognormal(mean_s: float, sd_s: float) -> Draw:
    sigma2 = log(1.0 + (sd_s / mean_s) ** 2)
    mu, sigma = log(mean_s) - 0.5 * sigma2, sqrt(sigma2)
    return lambda rng: exp(mu + sigma * rng.standard_normal())


def _gamma(mean_s: float, sd_s: float) -> Draw:
    shape, scale = (mean_s / sd_s) ** 2, sd_s**2 / mean_s
    # A shape far below 1 can round to 0, which is no valid time.
    return lambda rng: max(rng.gamma(shape, scale), 1e-9)


def _uniform(mean_s: float, sd_s: float) -> Draw:
    low, high = max(0.0, mean_s - sd_s), mean_s + sd_s
    return lambda rng: high - (high - low) * rng.random()  # random() may be 0, never 1


def _truncated_normal(mean_s: float, sd_s: float) -> Draw:
    cut = _cut(sd_s / mean_s)
    if cut is None:
        return lambda rng: mean_s * (rng.standard_exponential() or 1e-9)
    tail, excess, _ = _tail(cut)
    sigma = mean_s / excess

    def draw(rng: np.random.Generator) -> float:
        beyond = -_NORMAL.inv_cdf((1.0 - rng.random()) * tail) if tail < 0.5 else _above(rng, tail)
        return max(sigma * (beyond - cut), 1e-9)

    return draw


def _above(rng: np.random.Generator, tail: float) -> float:
    """Draw a standard normal number from its upper ``tail`` of more than a half."""
    # From the other end, so that the probability keeps its digits if the tail is nearly 1.
    p = (1.0 - tail) + tail * rng.random()
    return _NORMAL.inv_cdf(min(max(p, 1e-300), 1.0 - 1e-16))


def _cut(variation: float) -> float | None:
    """Return the cut of a standard normal law for this SD over mean; None: no cut."""
    low, high = _LEAST_CUT, _MOST_CUT
    if variation >= _tail(high)[2]:
        return None
    if variation <= _tail(low)[2]:
        return -1.0 / variation
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _tail(middle)[2] < variation else (low, middle)
    return low


def _tail(cut: float) -> tuple[float, float, float]:
    """Return probability, mean excess and SD over that of a standard normal law above ``cut``."""
    tail = 0.5 * erfc(cut / sqrt(2.0))
    hazard = exp(-0.5 * cut * cut) / sqrt(2.0 * pi) / tail
    excess = hazard - cut
    return tail, excess, sqrt(max(0.0, 1.0 - hazard * excess)) / excess

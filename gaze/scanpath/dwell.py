"""Dwell times: four laws for a measured mean and standard deviation, and rests without shifts.

Nakamoto & Tsuruno (3.2.3) take "mean +- SD" as the dwell time, but in their table 1 every SD is
above its mean, so that the interval reaches negative times. Each law treats that differently:

lognormal, gamma   positive, with exactly that mean and SD
truncated_normal   a normal law cut off at 0. Its SD is always below its mean; if the measured
                   one is not, the nearest such law is the exponential one, with the same
                   mean and an SD equal to it
uniform            evenly between mean - SD and mean + SD, an interval that is cut off at 0:
                   if SD > mean, the mean drawn is (mean + SD) / 2

Rests on the parts of a face last from landing to departure, and no less than servos can show. Table
1 of Nakamoto & Tsuruno times the gaze within the rectangle of a part, so that a visit, with its
refixations, includes about one shift between parts. Two of the eight parts are visited for no
longer than a shift and the shortest rest of people together (0.165 and 0.173 s). They get that and
a little more; the visits to the other parts become shorter by the same total, in proportion to
their excess over it. So the rate of shifts and the mean visit stay those of the table, and no rest
is cut off at the shortest duration.
"""

from collections.abc import Callable
from math import erfc, exp, log, pi, sqrt
from statistics import NormalDist

import numpy as np

from gazerig.gaze.types import Floats

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
    # With a shape far below 1 a draw can round to 0, which is not a valid time.
    return lambda rng: max(rng.gamma(shape, scale), 1e-9)


def _uniform(mean_s: float, sd_s: float) -> Draw:
    low, high = max(0.0, mean_s - sd_s), mean_s + sd_s
    return lambda rng: high - (high - low) * rng.random()  # random() may be 0, never 1


def _truncated_normal(mean_s: float, sd_s: float) -> Draw:
    cut = _cut_distribution(sd_s / mean_s)
    if cut is None:
        return lambda rng: mean_s * (rng.standard_exponential() or 1e-9)
    tail, excess, _ = _tail(cut)
    sigma = mean_s / excess

    def draw(rng: np.random.Generator) -> float:
        beyond = (
            -_NORMAL.inv_cdf((1.0 - rng.random()) * tail) if tail < 0.5 else _draw_above(rng, tail)
        )
        return max(sigma * (beyond - cut), 1e-9)

    return draw


def _draw_above(rng: np.random.Generator, tail: float) -> float:
    """Draw a standard normal number from its upper ``tail`` of more than a half."""
    # Computed from the other end, so that the probability does not lose digits if the tail is
    # nearly 1.
    p = (1.0 - tail) + tail * rng.random()
    return _NORMAL.inv_cdf(min(max(p, 1e-300), 1.0 - 1e-16))


def _cut_distribution(variation: float) -> float | None:
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


_LONGEST_S, _LONGEST = 3.0, 8.0
"""Longest rest, and the same over a mean rest for slow laws: a log-normal law whose SD is above its
mean would draw stares of many seconds."""
_LEAST_ABOVE = 0.15
"""Smallest mean excess of a rest over the shortest one, as a share of it."""


def stationary(matrix: Floats) -> Floats:
    """Return the share of steps that a chain spends in each of its states, (n,)."""
    # Staying at every other step changes no share, and makes every chain converge.
    lazy = 0.5 * (matrix + np.eye(len(matrix)))
    share = np.linalg.matrix_power(lazy, 1 << 20)[0]
    out: Floats = share / share.sum()
    return out


def visits_s(steps: Floats, dwell_s: Floats) -> Floats:
    """Return the mean visit of each part, its refixations included, (n,).

    steps: (n, n) transition probabilities of single dwells; a part that is never left for another
        has visits of one dwell
    """
    stays = np.diag(steps)
    visits: Floats = dwell_s / np.where(stays < 1.0, 1.0 - stays, 1.0)
    return visits


def rests_s(share: Floats, visit_s: Floats, shift_s: float, shortest_s: float) -> Floats:
    """Return the mean rest on each part, (n,).

    share: (n,) of the visits that go to each part
    visit_s: (n,) mean visits, shifts included; their overall mean is kept, unless no rest above the
        shortest one remains
    """
    above, least = visit_s - shift_s - shortest_s, _LEAST_ABOVE * shortest_s
    wanted, low, high = float(share @ above), 0.0, 1.0
    for _ in range(40):
        kept = 0.5 * (low + high)
        if share @ np.maximum(least, kept * above) > wanted:
            high = kept
        else:
            low = kept
    rests: Floats = shortest_s + np.maximum(least, low * above)
    return rests


def shift_dwell(law: str, mean_s: float, sd_s: float, shortest_s: float) -> Draw:
    """Return a dwell law that begins at a shortest time instead of at 0 and keeps the mean.

    A mean that is not above the shortest time is increased slightly. No law draws a stare.
    """
    if shortest_s <= 0.0:
        return dwell_distribution(law, mean_s, sd_s)
    above_s = max(mean_s - shortest_s, _LEAST_ABOVE * shortest_s)
    beyond = dwell_distribution(law, above_s, sd_s)
    longest_s = max(_LONGEST_S, _LONGEST * (shortest_s + above_s))
    return lambda rng: min(longest_s, shortest_s + beyond(rng))

"""Dwell times: a log-normal law for a measured mean and standard deviation.

Nakamoto & Tsuruno (3.2.3) take "mean +- SD" as the dwell time, but in their table 1 every SD is
above its mean, so that the interval reaches negative times. A log-normal law is positive, with
exactly that mean and SD.

Rests on the parts of a face last from landing to departure, and no less than servos can show.
"""

from collections.abc import Callable

import numpy as np

from gazerig.gaze.draws import draw_lognormal

Draw = Callable[[np.random.Generator], float]
"""Function that draws one dwell time in seconds, above 0."""

_LONGEST_S, _LONGEST = 3.0, 8.0
"""Longest rest, and the same over a mean rest for slow laws: a log-normal law whose SD is above its
mean would draw stares of many seconds."""
_LEAST_ABOVE = 0.15
"""Smallest mean excess of a rest over the shortest one, as a share of it."""


def lognormal_dwell(mean_s: float, sd_s: float) -> Draw:
    """Return the function that draws dwell times of a mean and standard deviation."""
    return lambda rng: draw_lognormal(rng, mean_s, sd_s / mean_s)


def rest_dwell(mean_s: float, sd_s: float, shortest_s: float) -> Draw:
    """Return a dwell law that begins at a shortest time instead of at 0 and keeps the mean.

    A mean that is not above the shortest time is increased slightly. No law draws a stare.
    """
    above_s = max(mean_s - shortest_s, _LEAST_ABOVE * shortest_s)
    beyond = lognormal_dwell(above_s, sd_s)
    longest_s = max(_LONGEST_S, _LONGEST * (shortest_s + above_s))
    return lambda rng: min(longest_s, shortest_s + beyond(rng))

"""Detection of ticks that come late. Times are in seconds.

Without a new goal a servo brakes to its last one. A guard that extrapolated the joint's motion
over a gap would send a jump: 2.3 times the top speed after 50 ms.
"""

from collections import deque
from math import inf

LATE_PERIODS = 1.5
"""A tick that comes more than this number of periods after the previous one is late."""

STEADY_TICKS, SLOWEST_S = 5, 0.05
"""This number of late ticks in a row, up to this interval apart, set a new pace: the bus or the
host is too slow for its rate. If each counted as a gap, a neck would reach only 10 deg/s."""


class LateTicks:
    """A detector of late ticks, after which acceleration is limited for some time.

    Attributes:
        soft_until_s: End of the limited acceleration.

    Args:
        period_s: Nominal time between ticks.
    """

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self.soft_until_s = -inf
        self._recent_s: deque[float] = deque([period_s], STEADY_TICKS)

    def split(self, since_s: float, t_s: float, soft_s: float) -> tuple[float, float]:
        """Return the time to move for, and the time without goals, 0 if the tick is not late.

        Args:
            since_s: Time since the previous tick.
            t_s: Present time.
            soft_s: Duration of the limited acceleration after a late tick.
        """
        recent_s = self._recent_s
        if since_s <= LATE_PERIODS * self.period_s:
            recent_s.append(since_s)
            return since_s, 0.0
        pace_s = max(self.period_s, min(SLOWEST_S, *recent_s))
        recent_s.append(since_s)
        if since_s <= LATE_PERIODS * pace_s:
            return since_s, 0.0
        self.soft_until_s = t_s + soft_s
        return pace_s, since_s - pace_s

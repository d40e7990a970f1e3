"""Ticks that come too late: no servo has gone on by itself meanwhile. Seconds.

Without a new goal a servo brakes to its last one. A guard that lets the joint be where it would
be by now, had it gone on, sends a leap of all that way: 2.3 times the top speed after 50 ms.
"""

from collections import deque
from math import inf

LATE_PERIODS = 1.5
"""A tick so many periods after the one before has missed a slot."""

STEADY_TICKS, SLOWEST_S = 5, 0.05
"""Where so many in a row came late, up to so much apart, that is the pace: a bus or a host too
slow for its rate. Each of them taken for a gap would leave a neck at 10 deg/s."""


class LateTicks:
    """Detects late ticks, and for how long acceleration is limited after one.

    soft_until_s: joints gather speed softly until then

    Args:
        period_s: nominal time between ticks.
    """

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self.soft_until_s = -inf
        self._recent_s: deque[float] = deque([period_s], STEADY_TICKS)

    def split(self, since_s: float, t_s: float, soft_s: float) -> tuple[float, float]:
        """Return the time to move for, and the time in which servos were left alone, 0 for none.

        Args:
            since_s: time since the tick before.
            t_s: now.
            soft_s: joints gather speed softly for so long after a late tick.
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

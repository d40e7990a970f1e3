"""Ticks that come too late: no servo has gone on by itself meanwhile. Seconds.

Without a new goal a servo brakes to its last one. A guard that lets the joint be where it would
be by now, had it gone on, sends a leap of all that way: 2.3 times the top speed after 50 ms.
"""

from math import inf

LATE_PERIODS = 1.5
"""A tick so many periods after the one before has missed a slot."""


class LateTicks:
    """Tells ticks that came too late, and for how long joints gather speed softly after one.

    Args:
        period_s: nominal time between ticks.
    """

    def __init__(self, period_s: float) -> None:
        self.period_s = period_s
        self._soft_until_s = -inf

    def split(self, since_s: float, t_s: float, soft_s: float) -> tuple[float, float]:
        """Return the time to move for, and the time in which servos were left alone, 0 for none.

        Args:
            since_s: time since the tick before.
            t_s: now.
            soft_s: joints gather speed softly for so long after a late tick.
        """
        if since_s <= LATE_PERIODS * self.period_s:
            return since_s, 0.0
        self._soft_until_s = t_s + soft_s
        return self.period_s, since_s - self.period_s

    def soft(self, t_s: float) -> bool:
        """Return whether joints gather speed softly now."""
        return t_s < self._soft_until_s

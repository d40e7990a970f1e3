"""Limits of a joint: range, speed, acceleration, and temperature and voltage of its servo."""

from math import inf
from typing import NamedTuple


class JointLimit(NamedTuple):
    """A joint's range, top speed and top acceleration (rad, rad/s, rad/s^2).

    The other fields are the limits at which the joint's servo switches itself off: temperature
    in deg C, lowest and highest voltage in V.
    """

    low_rad: float
    high_rad: float
    speed_rad_s: float
    accel_rad_s2: float
    hottest_c: float = 70.0
    lowest_v: float = 0.0
    highest_v: float = inf

    def within(self, reach: "JointLimit") -> "JointLimit":
        """Return these limits with range and speed reduced to a servo's own limits."""
        return self._replace(
            low_rad=min(max(self.low_rad, reach.low_rad), reach.high_rad),
            high_rad=max(min(self.high_rad, reach.high_rad), reach.low_rad),
            speed_rad_s=min(self.speed_rad_s, reach.speed_rad_s),
        )

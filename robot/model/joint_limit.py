"""What a joint may do: its range, speed and acceleration, and what its servo withstands."""

from math import inf
from typing import NamedTuple


class JointLimit(NamedTuple):
    """One joint's range, top speed and top acceleration (rad, rad/s, rad/s^2).

    The rest is what the joint's servo bears before it switches itself off: degrees
    Celsius, lowest and highest volts.
    """

    low_rad: float
    high_rad: float
    speed_rad_s: float
    accel_rad_s2: float
    hottest_c: float = 70.0
    lowest_v: float = 0.0
    highest_v: float = inf

    def within(self, reach: "JointLimit") -> "JointLimit":
        """Return the part of this range and speed that a servo's own limits leave."""
        return self._replace(
            low_rad=min(max(self.low_rad, reach.low_rad), reach.high_rad),
            high_rad=max(min(self.high_rad, reach.high_rad), reach.low_rad),
            speed_rad_s=min(self.speed_rad_s, reach.speed_rad_s),
        )

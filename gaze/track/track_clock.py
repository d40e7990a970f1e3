"""Clock of one track: its position and speed at each time of the loop."""

from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats


class TrackClock(NamedTuple):
    """Position in a track at constant speed, after a smooth change of the speed.

    from_s: time of the loop at which it starts; position_s: position then
    speed: speed after the change
    change_s: time of the change; rate: coefficients of the speed meanwhile, of fifth order
    """

    from_s: float
    position_s: float
    speed: float
    change_s: float = 0.0
    rate: tuple[float, ...] = ()

    def state_at(self, t_s: float) -> tuple[float, float, float]:
        """Return position, speed and acceleration at a time of the loop."""
        since_s = max(0.0, t_s - self.from_s)
        if not self.rate:
            return self.position_s + since_s * self.speed, self.speed, 0.0
        c0, c1, c2, c3, c4, c5 = self.rate
        t = min(since_s, self.change_s)
        position = t * (
            c0 + t * (c1 / 2.0 + t * (c2 / 3.0 + t * (c3 / 4.0 + t * (c4 / 5.0 + t * c5 / 6.0))))
        )
        if since_s >= self.change_s:
            later_s = since_s - self.change_s
            return self.position_s + position + later_s * self.speed, self.speed, 0.0
        return (
            self.position_s + position,
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
        )

    def has_reached(self, position_s: float, t_s: float) -> bool:
        """Return whether it is at a position or behind it at a time of the loop."""
        if self.rate or self.speed == 0.0:
            return self.state_at(t_s)[0] >= position_s
        return t_s >= self.from_s + (position_s - self.position_s) / self.speed

    def sample_at(self, times_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (n,) positions, speeds and accelerations at (n,) times of the loop."""
        position, rate, change = np.array([self.state_at(t) for t in times_s.tolist()]).T
        return position, rate, change

    def change_speed(self, t_s: float, speed: float, change_s: float) -> "TrackClock":
        """Return the clock that changes its speed from a time on, with continuous acceleration."""
        position, rate, change = self.state_at(t_s)
        d, T = speed - rate, change_s
        coefficients = (
            rate,
            change,
            0.0,
            (20.0 * d - 12.0 * change * T) / (2.0 * T**3),
            (-30.0 * d + 16.0 * change * T) / (2.0 * T**4),
            (12.0 * d - 6.0 * change * T) / (2.0 * T**5),
        )
        return TrackClock(t_s, position, speed, T, coefficients)

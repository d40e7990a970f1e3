"""Clock of one track: its position and speed at each time of the loop."""

from typing import NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import Quintic
from gazerig.gaze.types import Floats


class TrackClock(NamedTuple):
    """Position in a track at constant speed, after a smooth change of the speed.

    from_s: time of the loop at which it starts; position_s: position then
    speed: speed after the change
    change_s: time of the change; rate: the speed meanwhile; None: without a change
    """

    from_s: float
    position_s: float
    speed: float
    change_s: float = 0.0
    rate: Quintic | None = None

    def state_at(self, t_s: float) -> tuple[float, float, float]:
        """Return position, speed and acceleration at a time of the loop."""
        since_s = max(0.0, t_s - self.from_s)
        if self.rate is None:
            return self.position_s + since_s * self.speed, self.speed, 0.0
        position_s = self.position_s + self.rate.integral(min(since_s, self.change_s))
        if since_s >= self.change_s:
            return position_s + (since_s - self.change_s) * self.speed, self.speed, 0.0
        speed, acceleration, _ = self.rate.state_at(since_s)
        return position_s, speed, acceleration

    def has_reached(self, position_s: float, t_s: float) -> bool:
        """Return whether it is at a position or behind it at a time of the loop."""
        if self.rate is not None or self.speed == 0.0:
            return self.state_at(t_s)[0] >= position_s
        return t_s >= self.from_s + (position_s - self.position_s) / self.speed

    def sample_at(self, times_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (n,) positions, speeds and accelerations at (n,) times of the loop."""
        position, rate, change = np.array([self.state_at(t) for t in times_s.tolist()]).T
        return position, rate, change

    def change_speed(self, t_s: float, speed: float, change_s: float) -> "TrackClock":
        """Return the clock that changes its speed from a time on, with continuous acceleration."""
        position, rate, change = self.state_at(t_s)
        return TrackClock(
            t_s, position, speed, change_s, Quintic((rate, change, 0.0), speed, change_s)
        )

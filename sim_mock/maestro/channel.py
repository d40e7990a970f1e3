"""A channel of an emulated Maestro, configured as a servo.

Its output changes every 10 ms, by at most the speed limit (quarter microseconds per 10 ms). The
speed changes by at most the acceleration limit (the same per 80 ms), so that it comes to rest at
the target. Sums are stored in eighths, in which both limits are integers. Source: Pololu Maestro
User's Guide (0J40), sections 4.b and 5.e. Its braking is not documented; assumed: as late as
possible [A].
"""

from math import isqrt

EIGHTHS = 8
"""Periods of 10 ms in the 80 ms of the unit of acceleration."""


class EmulatedChannel:
    """A channel configured as a servo.

    target, position: commanded width and present width, quarter microseconds; 0: no pulses
    speed, acceleration: limits in the board's units; 0: unlimited
    """

    def __init__(self, low: int, high: int) -> None:
        self._low, self._high = low, high
        self.restart()

    def restart(self) -> None:
        """Reset to power-on: no pulses and no limits."""
        self.target = self.speed = self.acceleration = 0
        self._at8 = self._velocity8 = 0

    @property
    def position(self) -> int:
        """Return the present width; 0: no pulses."""
        return self._at8 // EIGHTHS

    @property
    def is_moving(self) -> bool:
        """Return whether it has not reached its target."""
        return self._at8 != self.target * EIGHTHS or self._velocity8 != 0

    def limit_speed(self, speed: int) -> None:
        """Limit the speed; 0: unlimited."""
        self.speed = speed

    def limit_acceleration(self, acceleration: int) -> None:
        """Limit the acceleration; 0: unlimited. Values above 255 count as 255 [A]."""
        self.acceleration = min(acceleration, 255)

    def set_target(self, steps: int) -> None:
        """Set the target, clipped to the limits; 0 ends the pulses.

        Without limits, or without pulses before, the output changes immediately: the board does not
        know the servo's position.
        """
        self.target = min(max(steps, self._low), self._high) if steps else 0
        if not steps or not self._at8 or not (self.speed or self.acceleration):
            self._at8, self._velocity8 = self.target * EIGHTHS, 0

    def step(self) -> None:
        """Advance by 10 ms."""
        if not self.is_moving:
            return
        way8 = self.target * EIGHTHS - self._at8
        sign = -1 if way8 < 0 else 1
        # The speed towards the target for the next 10 ms; below 0: still away from it.
        speed8, most8 = sign * self._velocity8, self.speed * EIGHTHS or abs(way8)
        if self.acceleration:
            wanted8 = min(most8, largest_braking_step(abs(way8), self.acceleration))
            speed8 = min(max(wanted8, speed8 - self.acceleration), speed8 + self.acceleration)
        else:
            speed8 = min(most8, abs(way8))
        velocity8 = sign * speed8
        at8 = self._at8 + velocity8
        self._at8 = min(max(at8, self._low * EIGHTHS), self._high * EIGHTHS)
        there = self._at8 == self.target * EIGHTHS and abs(velocity8) <= self.acceleration
        stopped = there or self._at8 != at8 or not self.acceleration
        self._velocity8 = 0 if stopped else velocity8


def largest_braking_step(way: int, acceleration: int) -> int:
    """Return the largest first step of a motion that comes to rest within a distance.

    Each further step is smaller by the acceleration; the last one is the smallest.
    """
    steps = (isqrt(1 + 8 * way // acceleration) - 1) // 2
    rest = way - acceleration * steps * (steps + 1) // 2
    return steps * acceleration + rest // (steps + 1)

"""One channel of an emulated Maestro: the pulse width that it sends, and its target.

Widths are quarter microseconds. The board changes its output every 10 ms, by at most the speed
limit (quarter microseconds per 10 ms). The speed changes by at most the acceleration limit (the
same per 80 ms), so that it comes to rest at the target. Sums are stored in eighths, in which both
limits are integers. Source: Pololu Maestro User's Guide (0J40), sections 4.b and 5.e. Its braking
is not documented; assumed: as late as possible [A].
"""

from math import isqrt

EIGHTHS = 8
"""Periods of 10 ms in the 80 ms of the unit of acceleration."""


class EmulatedChannel:
    """A channel configured as a servo.

    target, position: commanded width and present width; 0: no pulses
    speed, acceleration: limits in the board's units; 0: unlimited
    low, high: targets are clipped to these
    """

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high
        self.target = 0
        self.speed = self.acceleration = 0
        self._at8 = self._velocity8 = 0

    @property
    def position(self) -> int:
        """Return the present width; 0: no pulses."""
        return self._at8 // EIGHTHS

    @property
    def limited(self) -> bool:
        """Return whether it has a limit of speed or acceleration."""
        return self.speed != 0 or self.acceleration != 0

    @property
    def moving(self) -> bool:
        """Return whether it has not reached its target."""
        return self._at8 != self.target * EIGHTHS or self._velocity8 != 0

    @property
    def led(self) -> bool:
        """Return whether it moves under a limit, which the board reports as moving."""
        return self.limited and self.moving

    def limit_speed(self, speed: int) -> None:
        """Limit the speed; 0: unlimited."""
        self.speed = speed

    def limit_acceleration(self, acceleration: int) -> None:
        """Limit the acceleration; 0: unlimited. Values above 255 count as 255 [A]."""
        self.acceleration = min(acceleration, 255)

    def aim(self, steps: int) -> None:
        """Set the target, clipped to the limits; 0 ends the pulses.

        Without limits, or without pulses before, the output changes immediately: the board does not
        know the servo's position.
        """
        self.target = min(max(steps, self.low), self.high) if steps else 0
        if not steps or not self._at8 or not self.limited:
            self._arrive()

    def limit(self, low: int, high: int) -> None:
        """Set other limits of targets."""
        self.low, self.high = low, high
        if self.target:
            self.target = min(max(self.target, low), high)
            self._at8 = min(max(self._at8, low * EIGHTHS), high * EIGHTHS)

    def restart(self, speed: int = 0, acceleration: int = 0) -> None:
        """Reset to power-on: no pulses, the configured limits of speed and acceleration."""
        self.speed, self.acceleration = speed, acceleration
        self.aim(0)

    def step(self) -> None:
        """Advance by 10 ms."""
        if not self.moving:
            return
        if not self.limited:
            self._arrive()
            return
        way8 = self.target * EIGHTHS - self._at8
        sign = -1 if way8 < 0 else 1
        velocity8 = sign * self._next_speed8(abs(way8), sign * self._velocity8)
        at8 = self._at8 + velocity8
        self._at8 = min(max(at8, self.low * EIGHTHS), self.high * EIGHTHS)
        clipped = self._at8 != at8
        there = self._at8 == self.target * EIGHTHS and abs(velocity8) <= self.acceleration
        self._velocity8 = 0 if clipped or there or not self.acceleration else velocity8

    def _next_speed8(self, way8: int, speed8: int) -> int:
        """Return the speed towards the target for the next 10 ms; below 0: still away from it."""
        most8 = self.speed * EIGHTHS or way8
        if not self.acceleration:
            return min(most8, way8)
        wanted8 = min(most8, largest_braking_step(way8, self.acceleration))
        return min(max(wanted8, speed8 - self.acceleration), speed8 + self.acceleration)

    def _arrive(self) -> None:
        self._at8, self._velocity8 = self.target * EIGHTHS, 0


def largest_braking_step(way: int, acceleration: int) -> int:
    """Return the largest first step of a motion that comes to rest within a distance.

    Each further step is smaller by the acceleration; the last one is the smallest.
    """
    steps = (isqrt(1 + 8 * way // acceleration) - 1) // 2
    rest = way - acceleration * steps * (steps + 1) // 2
    return steps * acceleration + rest // (steps + 1)

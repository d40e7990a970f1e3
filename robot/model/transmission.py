"""Linkages between a servo's steps and a joint's angle: a gear, or a measured push rod.

A push rod turns its joint less, the farther its horn is from a right angle, so hobby eye
mechanisms have no constant ratio. Some points are measured and interpolated linearly. Angles are
in rad at the joint, steps at the servo.
"""

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple, Protocol


class Line(NamedTuple):
    """A linear linkage: steps = zero + slope * angle and angle = (steps - zero) * rate."""

    zero: float
    slope: float
    rate: float


class Linkage(Protocol):
    """A linkage between a servo and its joint.

    Attributes:
        steepest: Largest number of steps per rad, above 0.
        rising: Whether more steps give a larger angle.
        line: The line of a linear linkage, else None.
    """

    steepest: float
    rising: bool
    line: "Line | None"

    def steps(self, angle_rad: float) -> float:
        """Return the servo position of a joint angle, not rounded."""
        ...

    def angle_rad(self, steps: float) -> float:
        """Return the joint angle of a servo position."""
        ...

    def rate_rad(self, steps: float) -> float:
        """Return the signed angle in rad per step at a servo position."""
        ...


class Straight:
    """A gear with a constant ratio; implements Linkage.

    Args:
        zero: Steps at 0 rad.
        slope: Signed steps per rad.
    """

    def __init__(self, zero: float, slope: float) -> None:
        self.line: Line | None = Line(zero, slope, 1.0 / slope)
        self._zero, self._slope, self._rate = self.line
        self.steepest = abs(slope)
        self.rising = slope > 0.0

    def steps(self, angle_rad: float) -> float:
        """Return the servo position of a joint angle, not rounded."""
        return self._zero + self._slope * angle_rad

    def angle_rad(self, steps: float) -> float:
        """Return the joint angle of a servo position."""
        return (steps - self._zero) * self._rate

    def rate_rad(self, steps: float) -> float:
        """Return the signed angle in rad per step."""
        return self._rate


class Curve:
    """A linear interpolation of measured points; implements Linkage.

    The outermost lines extrapolate beyond the points.

    Args:
        angles_rad: Rising angles, at least two.
        steps: Steps, all rising or all falling.

    Raises:
        ValueError: The points are not of that form; the message gives the position.
    """

    def __init__(self, angles_rad: Sequence[float], steps: Sequence[float]) -> None:
        if len(angles_rad) < 2 or len(angles_rad) != len(steps):
            raise ValueError("a linkage needs two places or more, each an angle and a position")
        up = steps[-1] > steps[0]
        for i in range(1, len(steps)):
            if angles_rad[i] <= angles_rad[i - 1]:
                raise ValueError(f"the angles of a linkage must rise; place {i + 1} does not")
            if (steps[i] > steps[i - 1]) != up or steps[i] == steps[i - 1]:
                raise ValueError(
                    "the positions of a linkage must all rise or all fall; "
                    f"place {i + 1} goes back: measure it again"
                )
        self.rising = up
        self.line: Line | None = None
        self._angles, self._steps = tuple(angles_rad), tuple(float(s) for s in steps)
        # Keys rise for both directions of the rod.
        self._order = 1.0 if up else -1.0
        self._keys = tuple(self._order * s for s in self._steps)
        self._slopes = tuple(
            (self._steps[i] - self._steps[i - 1]) / (self._angles[i] - self._angles[i - 1])
            for i in range(1, len(steps))
        )
        self._last = len(self._slopes) - 1
        self.steepest = max(abs(slope) for slope in self._slopes)

    def steps(self, angle_rad: float) -> float:
        """Return the servo position of a joint angle, not rounded."""
        i = min(max(bisect_right(self._angles, angle_rad) - 1, 0), self._last)
        return self._steps[i] + self._slopes[i] * (angle_rad - self._angles[i])

    def angle_rad(self, steps: float) -> float:
        """Return the joint angle of a servo position."""
        i = self._segment(steps)
        return self._angles[i] + (steps - self._steps[i]) / self._slopes[i]

    def rate_rad(self, steps: float) -> float:
        """Return the signed angle in rad per step at a servo position."""
        return 1.0 / self._slopes[self._segment(steps)]

    def _segment(self, steps: float) -> int:
        return min(max(bisect_right(self._keys, self._order * steps) - 1, 0), self._last)

"""Sway: the small random motion of a head that is held still.

A head at rest wanders by some tenths of a degree, more the slower: its power falls with frequency.
Each axis is a sum of octaves, as in Perlin's noise for figures (Perlin 1995): an octave moves by
minimum jerk from one random value to the next, in about its period. Octaves of equal size have the
spectrum 1/f between the fastest and the slowest. Values are bounded, position, speed and
acceleration are continuous, and the draws do not depend on the rate of the ticks.

The sway is added to the head model's angles, and the eyes compensate it. At the defaults the goal
of a neck servo moves by about a tenth of an encoder step (.088 deg) in a tick of 5 ms.
"""

from dataclasses import dataclass
from math import ceil, log2, radians, sqrt
from typing import Annotated

import numpy as np

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.types import Angles3
from gazerig.params import Bounds

_STILL: Angles3 = (0.0, 0.0, 0.0)
_GLIDE_S = 1.0  # time in which a retuned sway reaches its new size
_VARIANCE = 0.264
"""Mean variance of an octave of size 1: uniform values -1..1, joined by minimum jerk."""


@dataclass(frozen=True)
class SwayParams:
    """Size and periods."""

    # fmt: off
    yaw_deg: Annotated[float, Bounds(0, 3), "standard deviation of the head's random yaw at rest; people: .2 to 1.5; 0: none"] = 0.6
    pitch_deg: Annotated[float, Bounds(0, 3), "standard deviation of its pitch"] = 0.4
    roll_deg: Annotated[float, Bounds(0, 3), "standard deviation of its roll"] = 0.6
    fastest_s: Annotated[float, Bounds(0.2, 60), "mean time of the fastest movements of the sway; shorter ones make servos audible"] = 1.5
    slowest_s: Annotated[float, Bounds(0.2, 600), "mean time of the slowest movements"] = 24.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check the order of the times.

        Raises:
            ValueError: slowest_s is below fastest_s.
        """
        if self.slowest_s < self.fastest_s:
            raise ValueError("slowest_s must not be below fastest_s")


class Sway:
    """Random sway of yaw, pitch and roll.

    Args:
        params: size and periods.
        rng: random generator of values and times; None: no sway.
    """

    def __init__(self, params: SwayParams, rng: np.random.Generator | None = None) -> None:
        self._rng = rng
        self._t_s = 0.0
        self._set_params(params)
        self.reset(0.0)

    def _set_params(self, params: SwayParams) -> None:
        octaves = 1 + ceil(log2(params.slowest_s / params.fastest_s) - 1e-9)
        self._periods_s = [params.fastest_s * 2.0**k for k in range(octaves)]
        unit = 1.0 / sqrt(_VARIANCE * octaves)
        yaw, pitch, roll = (
            radians(d) * unit for d in (params.yaw_deg, params.pitch_deg, params.roll_deg)
        )
        self._sizes: Angles3 = (yaw, pitch, roll)

    def reset(self, t_s: float) -> None:
        """Start at the centre."""
        self._t_s = self._retuned_s = t_s
        self._before = [*self._sizes]
        self._axes = [[_Octave(period_s, t_s) for period_s in self._periods_s] for _ in _STILL]

    def retune(self, params: SwayParams) -> None:
        """Change size and periods; the size changes gradually, new periods start at the centre."""
        periods, self._before = self._periods_s, [*self._sizes_at(self._t_s)]
        self._set_params(params)
        self._retuned_s = self._t_s
        if self._periods_s != periods:
            self.reset(self._t_s)

    def step(self, t_s: float) -> Angles3:
        """Return the (yaw, pitch, roll) to add to the head's."""
        self._t_s = t_s
        sizes = self._sizes_at(t_s)
        return _STILL if self._rng is None or sizes == _STILL else self._wander(sizes, self._rng)

    def _sizes_at(self, t_s: float) -> Angles3:
        """Return the size of an octave of each axis; after a retune it changes gradually."""
        share = min_jerk((t_s - self._retuned_s) / _GLIDE_S)
        if share >= 1.0:
            return self._sizes
        a, b = self._before, self._sizes
        yaw, pitch, roll = (x + share * (y - x) for x, y in zip(a, b, strict=True))
        return yaw, pitch, roll

    def _wander(self, sizes: Angles3, rng: np.random.Generator) -> Angles3:
        """Return the sum of all octaves; in one loop, as it is computed in every tick."""
        t_s = self._t_s
        angles = []
        for size, octaves in zip(sizes, self._axes, strict=True):
            total = 0.0
            for octave in octaves:
                if t_s >= octave.end_s:
                    octave.move_on(t_s, rng)
                s = (t_s - octave.begin_s) / (octave.end_s - octave.begin_s)
                share = s * s * s * (10.0 + s * (6.0 * s - 15.0))  # eq 2, as in min_jerk
                total += octave.start + share * (octave.goal - octave.start)
            angles.append(size * total)
        yaw, pitch, roll = angles
        return (yaw, pitch, roll)


class _Octave:
    """Movements between random values -1..1, each within half to one and a half of a period."""

    def __init__(self, period_s: float, t_s: float) -> None:
        self._period_s = period_s
        self.start = self.goal = 0.0
        self.begin_s = self.end_s = t_s

    def move_on(self, t_s: float, rng: np.random.Generator) -> None:
        """Begin the movement at a time; times must not decrease."""
        while t_s >= self.end_s:
            self.start, self.goal = self.goal, float(rng.uniform(-1.0, 1.0))
            self.begin_s = self.end_s
            self.end_s += self._period_s * float(rng.uniform(0.5, 1.5))

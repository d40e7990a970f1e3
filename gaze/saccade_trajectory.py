"""One saccade under way: the gaze point between take-off and landing.

The path is the great circle between the two directions, so that both axes start and end
together, and the points are seen from where the head is at each moment, so that its own
motion moves neither end; the nearness, and with it vergence, goes by the same profile.
"""

import numpy as np

from gazerig.gaze.angles import (
    add,
    along_great_circle,
    angle_between,
    beside,
    norm,
    scale,
    sub,
    unit,
)
from gazerig.gaze.saccade import SaccadeModel
from gazerig.gaze.types import Vec3


class SaccadeTrajectory:
    """The gaze point on its way from one point in the world to another."""

    def __init__(
        self, saccade: SaccadeModel, start: Vec3, end: Vec3, eye: Vec3, onset_s: float
    ) -> None:
        self._profile, self._start, self._end = saccade.profile, start, end
        self._start_way, self._end_way = unit(sub(start, eye)), unit(sub(end, eye))
        self.onset_s = onset_s
        self.amplitude_rad = angle_between(self._start_way, self._end_way)
        self.ends_s = onset_s + self._profile.duration_s(self.amplitude_rad)

    def at(self, eye: Vec3, t_s: float) -> Vec3:
        """Return the gaze point, seen from where the eyes are now."""
        done = self._profile.displacement_rad(self.amplitude_rad, t_s - self.onset_s)
        share = done / self.amplitude_rad if self.amplitude_rad > 0.0 else 1.0
        a, b = sub(self._start, eye), sub(self._end, eye)
        near_a, near_b = 1.0 / norm(a), 1.0 / norm(b)
        # The great circle stays that of the onset and both ends' parallax is added: the
        # plane through two nearly opposite directions would swing with the least of it.
        way = along_great_circle(self._start_way, self._end_way, share)
        way = add(way, scale(sub(scale(a, near_a), self._start_way), 1.0 - share))
        way = add(way, scale(sub(scale(b, near_b), self._end_way), share))
        return add(eye, scale(unit(way), 1.0 / ((1.0 - share) * near_a + share * near_b)))

    def landed(self, t_s: float) -> bool:
        """Return whether it is over."""
        return t_s >= self.ends_s - 1e-9


def scattered_endpoint(
    end: Vec3, start: Vec3, eye: Vec3, along: float, across: float, rng: np.random.Generator
) -> Vec3:
    """Return where a saccade lands whose noise grows with its size (Harris & Wolpert).

    along, across: standard deviations as shares of the amplitude
    """
    a, b = sub(start, eye), sub(end, eye)
    amplitude = angle_between(a, b)
    further, aside = (float(n) for n in rng.standard_normal(2))
    way = beside(unit(b), unit(a), along * amplitude * further, across * amplitude * aside)
    return add(eye, scale(way, norm(b)))

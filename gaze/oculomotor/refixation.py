"""Re-fixations: small saccades within a target during a long look.

People's eyes never rest for seconds: they make one to two small saccades per second, most of them
below 1 deg (Otero-Millan et al. 2013). A servo shows those that are larger than its steps and its
play. So the gaze moves between points near the middle of a target, with rests in between.
"""

from math import cos, hypot, inf, pi, radians, sin, sqrt

import numpy as np

from gazerig.gaze.oculomotor.params import OculomotorParams
from gazerig.gaze.types import Angles2

_TRIES = 12


class Refixations:
    """Successive gaze points about the middle of a target.

    offset_rad: offset of the present one, to the left and up; (0, 0): the middle itself
    """

    def __init__(self, params: OculomotorParams, rng: np.random.Generator | None) -> None:
        self._rng = rng
        self.retune(params)
        self.reset()

    def retune(self, params: OculomotorParams) -> None:
        """Change sizes and intervals, from the next rest on."""
        self._least_rad = radians(params.refixation_least_deg)
        self._most_rad = radians(params.refixation_deg)
        self._after_s = params.refixation_after_ms / 1e3
        self._spread_s = params.refixation_spread_ms / 1e3

    def reset(self) -> None:
        """Look at the middle of a new target."""
        self.offset_rad: Angles2 = (0.0, 0.0)
        self._due_s = inf

    def interrupt(self) -> None:
        """Restart the rest, as the gaze has moved."""
        self._due_s = inf

    def due(self, t_s: float, still: bool = True) -> bool:
        """Return whether another point is chosen now; called in every tick of a rest.

        still: whether the target is at rest; a moving one is only followed
        """
        if t_s < self._due_s:
            if self._due_s == inf and self._rng is not None and self._most_rad > 0.0:
                self._due_s = t_s + self._after_s + self._spread_s * float(self._rng.random())
            return False
        self._due_s = inf
        return still and self._choose()

    def _choose(self) -> bool:
        """Draw a point near the middle, one step away from the last."""
        if self._rng is None:
            return False
        across, up = self.offset_rad
        radius = 0.75 * self._most_rad
        for _ in range(_TRIES):
            r, angle = radius * sqrt(self._rng.random()), 2.0 * pi * self._rng.random()
            x, y = r * cos(angle), r * sin(angle)
            if self._least_rad <= hypot(x - across, y - up) <= self._most_rad:
                self.offset_rad = (x, y)
                return True
        return False

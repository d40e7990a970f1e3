"""Reaction time: from a new winner of attention to the change of target.

People look at a new thing 150 to 250 ms after its appearance, hardly ever before 120 ms (express
saccades), and the times are skewed: log-normal here. The time counts from the capture of the frame
in which the new target won, so it includes the delay of the camera. A later winner takes over the
running time, since a saccade is programmed as a time and a goal; a target that is no longer the
winner is dropped. Meanwhile the gaze stays on the present target.

The reaction to a fast approach is quicker, and so is that to a recently viewed face. A change of
behaviour is the robot's own decision, not a stimulus: it has no reaction time.
"""

from math import exp, inf

import numpy as np

from gazerig.gaze.types import Target

_MEDIAN_S, _SPREAD = 0.15, 0.15
"""Median, and standard deviation of the logarithm."""
_LOOMING = 0.65
"""Share of that time for a fast approach."""
_RETURN, _RETURN_S = 0.8, 5.0
"""Share of it for a face, and time for which a face counts as just looked at."""


class Reaction:
    """The next target, during its reaction time.

    Attributes:
        immediate: whether there are no reaction times.
        next: the pending target, None without one or when it is no longer the winner.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.immediate = False
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget the pending target and the former ones."""
        self.next: Target | None = None
        self._drawn_s = 0.0
        self._won_s = self._free_s = t_s
        self._left_s: dict[int, float] = {}

    def record_left(self, kind: str, id: int, t_s: float) -> None:
        """Record a target that the gaze has left."""
        if kind == "face":
            self._left_s = {k: at_s for k, at_s in self._left_s.items() if t_s - at_s < _RETURN_S}
            self._left_s[id] = t_s

    def start_waiting(self, target: Target, free_s: float) -> None:
        """Start the reaction time of a winning target; if one is pending, continue its time.

        free_s: earliest time of the change
        """
        if self.next is None:
            self._won_s = target.at_s
            self._drawn_s = _MEDIAN_S * exp(_SPREAD * float(self._rng.standard_normal()))
        self.next, self._free_s = target, free_s

    def take_due(self, t_s: float) -> Target | None:
        """Return the target whose reaction time is over, once; None without one."""
        target = self.next
        if target is None:
            return None
        due_s = -inf if self.immediate else self._won_s + self._ratio(target) * self._drawn_s
        if t_s < max(self._free_s, due_s) - 1e-9:
            return None
        self.next = None
        return target

    def _ratio(self, target: Target) -> float:
        """Return the share of the drawn time that applies to a target."""
        first, ratio = target.saliences[0], 1.0
        if first.looming > max(first.translation, first.rotation, first.onset, first.rule):
            ratio = _LOOMING
        left_s = self._left_s.get(target.id, -inf)
        if target.kind == "face" and target.at_s - left_s <= _RETURN_S:
            ratio = min(ratio, _RETURN)
        return ratio

"""Reaction time: from a new winner of attention to the change of target.

People look at a new thing 150 to 250 ms after its appearance, hardly ever before 120 ms (express
saccades), and the times are skewed: log-normal here. The time counts from the capture of the frame
in which the new target won, so it includes the delay of the camera. A later winner takes over the
running time, since a saccade is programmed as a time and a goal; a target that is no longer the
winner is dropped. Meanwhile the gaze stays on the present target.

The reaction to a fast approach is quicker. A change of behaviour is the robot's own decision, not a
stimulus: it has no reaction time.
"""

from math import exp, inf

import numpy as np

from gazerig.gaze.types import Target

_MEDIAN_S, _SPREAD = 0.15, 0.15
"""Median, and standard deviation of the logarithm."""
_LOOMING = 0.65
"""Share of that time for a fast approach."""


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
        """Forget the pending target."""
        self.next: Target | None = None
        self._drawn_s = 0.0
        self._won_s = self._free_s = t_s

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
        due_s = -inf if self.immediate else self._won_s + _ratio(target) * self._drawn_s
        if t_s < max(self._free_s, due_s) - 1e-9:
            return None
        self.next = None
        return target


def _ratio(target: Target) -> float:
    first = target.saliences[0]
    looms = first.looming > max(first.translation, first.rotation, first.onset, first.rule)
    return _LOOMING if looms else 1.0

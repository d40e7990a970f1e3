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

from gazerig.gaze.attention.params import ReactionParams
from gazerig.gaze.types import Target


class Reaction:
    """The next target, during its reaction time.

    Args:
        params: the distribution.
        rng: draws one time for each change of target; None: all changes are immediate.
    """

    def __init__(self, params: ReactionParams, rng: np.random.Generator | None = None) -> None:
        self._rng = rng
        self._params = params
        self.reset(0.0)

    def retune(self, params: ReactionParams) -> None:
        """Change the distribution; a reaction in progress keeps its quantile."""
        self._params = params

    def reset(self, t_s: float) -> None:
        """Forget the pending target and the former ones."""
        self._next: Target | None = None
        self._deviation = 0.0
        self._won_s = self._free_s = t_s
        self._left_s: dict[int, float] = {}

    def record_left(self, kind: str, id: int, t_s: float) -> None:
        """Record a target that the gaze has left."""
        if kind == "face":
            lasts_s = self._params.return_s
            self._left_s = {k: at_s for k, at_s in self._left_s.items() if t_s - at_s < lasts_s}
            self._left_s[id] = t_s

    def start_waiting(self, target: Target, free_s: float) -> None:
        """Start the reaction time of a winning target; if one is pending, continue its time.

        free_s: earliest time of the change
        """
        if self._next is None:
            self._won_s = target.at_s
            self._deviation = float(self._rng.standard_normal()) if self._rng is not None else 0.0
        self._next, self._free_s = target, free_s

    def drop(self) -> None:
        """Drop the pending target, as it is no longer the winner."""
        self._next = None

    @property
    def is_waiting(self) -> bool:
        """Return whether a target is pending."""
        return self._next is not None

    def take_due(self, t_s: float) -> Target | None:
        """Return the target whose reaction time is over, once; None without one."""
        target = self._next
        if target is None or t_s < max(self._free_s, self._due_s(target)) - 1e-9:
            return None
        self._next = None
        return target

    def _due_s(self, target: Target) -> float:
        """Return the end of a target's reaction time."""
        par = self._params
        if self._rng is None or par.median_ms <= 0.0:
            return -inf
        drawn_s = 1e-3 * par.median_ms * exp(par.spread * self._deviation)
        return self._won_s + self._ratio(target) * drawn_s

    def _ratio(self, target: Target) -> float:
        """Return the share of the drawn time that applies to a target."""
        par, first = self._params, target.saliences[0]
        ratio = 1.0
        if first.looming > max(first.translation, first.rotation, first.onset, first.rule):
            ratio = par.looming_ratio
        left_s = self._left_s.get(target.id, -inf)
        if target.kind == "face" and target.at_s - left_s <= par.return_s:
            ratio = min(ratio, par.return_ratio)
        return ratio

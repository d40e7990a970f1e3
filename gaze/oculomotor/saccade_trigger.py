"""Saccade trigger: choice between a saccade and smooth pursuit to close an error.

A new object or part of it (the target's event flag) triggers a saccade at once. Without that, an
error beyond 2 deg does, unless the eye is about to cross the target anyway: with the error PE and
the retinal slip RV the crossing is T = -PE / RV away, and between 40 and 180 ms smooth pursuit
closes it (de Brouwer et al. 2002). If landings scatter, another saccade some 150 ms later corrects
an error beyond 1.2 deg, or some 200 ms later one of a target that moves, unless it is beyond 4 deg;
an exact landing has an error only if the target was misjudged, and pursuit closes that. No error
triggers a saccade within the refractory time after the last, and no event within ``_INTERVAL_S``
after its landing. A new target early in a saccade redirects it; a later one is delayed by that
interval. The papers' saccades have none of these: they go on to their ends, and the next may follow
at once.
"""

from math import inf, radians

from gazerig.gaze.angles import dot, norm
from gazerig.gaze.oculomotor.pursuit import Slip

_SMALLEST_RAD = radians(0.3)
"""A new target closer to the gaze than this gets no saccade."""
_SACCADE_RAD = radians(2.0)
_CORRECT_RAD = radians(1.2)
_FAR_RAD = radians(4.0)
"""An error beyond this waits for the refractory time alone."""
_INTERVAL_S = 0.1
_REDIRECT_S = 0.07
"""A new target bends the saccade in flight if it appears at least this long before its end."""
_CROSSING_S = (0.04, 0.18)


class SaccadeTrigger:
    """State of the events that require a saccade, and the decision of its start.

    shift: the target's count of gaze shifts recorded last, None before the first
    onset_s: start of the last saccade, or planned start of the next

    Args:
        people: whether saccades are people's, which miss their targets, or the papers'.
    """

    def __init__(self, people: bool) -> None:
        self.retune(people)
        self.reset(0.0)

    def retune(self, people: bool) -> None:
        """Change the law; a pending event stays pending."""
        self._people = people
        self._interval_s = _INTERVAL_S if people else 0.0
        self._redirect_s = _REDIRECT_S if people else inf

    def reset(self, t_s: float) -> None:
        """Start with no event and no refractory time."""
        self.shift: int | None = None
        self._due_s: float | None = None
        self._landed_s = -inf
        self._correct_s = 0.0
        self._erred: bool | None = False
        self.onset_s = t_s

    def record_shift(self, shift: int, wait_s: float, lands_s: float | None, t_s: float) -> None:
        """Record the target's count of gaze shifts.

        wait_s: wait of the eyes, because the head goes first
        lands_s: landing time of the saccade in flight, None without one
        """
        if shift == self.shift:
            return
        self.shift = shift
        self._erred = False
        if self._due_s is None:
            # A later event only changes the saccade's goal.
            due_s, after_s = t_s + wait_s, self._landed_s
            if lands_s is not None:
                after_s = -inf if due_s <= lands_s - self._redirect_s else lands_s
            self._due_s = self.onset_s = max(due_s, after_s + self._interval_s)

    def postpone(self, wait_s: float) -> None:
        """Delay the next saccade."""
        if self._due_s is not None:
            self._due_s = self.onset_s = self._due_s + wait_s

    def may_redirect(self, t_s: float) -> bool:
        """Return whether a new target bends the saccade in flight now, at most once for each."""
        if self._due_s is None or t_s < self._due_s - 1e-9:
            return False
        self._due_s = None
        return True

    def refixate(self, t_s: float) -> None:
        """Request a small saccade to another point of the same target."""
        if self._due_s is None:
            self._due_s = t_s

    def record_landing(self, t_s: float, correct_after_s: float) -> None:
        """Record the end of a saccade, and the delay until its error may be corrected."""
        self._landed_s, self._correct_s = t_s, correct_after_s
        self._erred = None if self._people else False

    def is_error_small(self, error_rad: float) -> bool:
        """Return whether no event is pending and no error requires one: ``is_due`` is False."""
        return self._due_s is None and self._erred is False and error_rad <= _SACCADE_RAD

    def is_due(self, slip: Slip, t_s: float, refractory_s: float) -> bool:
        """Return whether a saccade starts now; called only between saccades.

        refractory_s: shortest time after a saccade before an error alone triggers the next
        """
        error = norm(slip.error_rad)
        if self._erred is None:
            self._erred = error > _CORRECT_RAD
        if self._due_s is not None:
            if t_s < self._due_s - 1e-9:
                return False
            self._due_s = None
            if error > _SMALLEST_RAD:
                return self._go(t_s)
        rested_s = t_s - self._landed_s
        if self._erred:
            if error <= _CORRECT_RAD:
                self._erred = False
            elif rested_s >= self._correct_s - 1e-9:
                return self._go(t_s)
        if error <= _FAR_RAD:
            refractory_s = max(refractory_s, self._correct_s)
        if error <= _SACCADE_RAD or rested_s < refractory_s:
            return False
        return not (self._people and _crosses(slip, error)) and self._go(t_s)

    @property
    def is_saccade_due(self) -> bool:
        """Return whether the saccade to a new target has not started yet."""
        return self._due_s is not None

    @property
    def is_correction_due(self) -> bool:
        """Return whether the error of the last saccade waits for a correction."""
        return bool(self._erred)

    def _go(self, t_s: float) -> bool:
        self.onset_s = t_s
        self._erred = False
        return True


def _crosses(slip: Slip, error_rad: float) -> bool:
    """Return whether the target meets the line of sight soon by its own motion."""
    closing = -dot(slip.error_rad, slip.slip_rad_s) / error_rad
    least, most = _CROSSING_S
    return closing > 0.0 and least < error_rad / closing < most

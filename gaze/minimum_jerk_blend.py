"""Values that follow goals smoothly, however often the goals change.

Each change of the goal starts a minimum-jerk move by the difference, and moves under way are
added up (the superposition of Flash and Henis 1991 for targets that jump). Position, speed
and acceleration are continuous at every moment. With one duration the result is a weighted
mean of the goals, so it never leaves their range, and its speed never exceeds that of a
single move over this range: 1.875 x range / duration.
"""

from typing import NamedTuple

from gazerig.gaze.saccade import min_jerk

PEAK_SPEED = 1.875
"""Highest speed of a minimum-jerk move of length 1 in time 1."""
PEAK_ACCELERATION = 5.7735
"""Its highest acceleration, 10 / sqrt 3."""
_MOVES_AT_ONCE = 32
"""Goals that come faster than so many in one duration wait for their turn; the newest counts."""

Values = tuple[float, ...]


class _Move(NamedTuple):
    start_s: float
    duration_s: float
    delta: Values


class MinimumJerkBlend:
    """Several values on their way to the newest goal.

    Args:
        start: the values to begin with.
        duration_s: of one move, above 0.
    """

    def __init__(self, start: Values, duration_s: float) -> None:
        self.duration_s = duration_s
        self.reset(start)

    def reset(self, values: Values) -> None:
        """Rest at values at once."""
        self._values = self._base = self._planned = self._goal = values
        self._moves: list[_Move] = []

    def move_to(self, goal: Values) -> None:
        """Move to another goal, from the next step on; as many values as at the start."""
        if goal != self._goal:  # an equal goal stays the tuple that is planned: cheap to compare
            self._goal = goal

    def step(self, t_s: float) -> Values:
        """Return the values at a time; times never go back. At rest it is the same tuple."""
        goal = self._goal
        if goal is not self._planned and goal != self._planned and self._may_start(t_s):
            delta = tuple([b - a for a, b in zip(self._planned, self._goal, strict=True)])
            self._moves.append(_Move(t_s, self.duration_s, delta))
            self._planned = self._goal
        if self._moves:
            self._values = self._sum(t_s)
        return self._values

    @property
    def rests(self) -> bool:
        """Return whether ``step`` returns the same tuple from now on, until there is a new goal."""
        return not self._moves and self._goal == self._planned

    def _may_start(self, t_s: float) -> bool:
        pause_s = self.duration_s / _MOVES_AT_ONCE
        return not self._moves or t_s - self._moves[-1].start_s >= pause_s

    def _sum(self, t_s: float) -> Values:
        """Add up the moves under way; those that are over go into the base."""
        ended = [move for move in self._moves if t_s >= move.start_s + move.duration_s]
        if len(ended) == len(self._moves):
            self._moves = []
            self._base = self._planned
            return self._base
        for move in ended:
            self._moves.remove(move)
            self._base = _added(self._base, move.delta, 1.0)
        values = self._base
        for move in self._moves:
            values = _added(values, move.delta, min_jerk((t_s - move.start_s) / move.duration_s))
        return values


def _added(values: Values, delta: Values, factor: float) -> Values:
    return tuple([v + factor * d for v, d in zip(values, delta, strict=True)])

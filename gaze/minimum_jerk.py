"""Minimum-jerk movements: between two rests, from any state to rest, and to moving goals.

``min_jerk`` is eq 2 (and eq 8) of Mitake et al. ``Quintic`` starts from any position, speed and
acceleration; it is the smoothest curve (least jerk) between given ends. ``MinimumJerkBlend``
follows goals that change at any time: each change starts a minimum-jerk move by the difference, and
active moves are summed (the superposition of Flash and Henis 1991 for targets that jump). Any unit;
speed and acceleration are per second.
"""

from typing import NamedTuple

PEAK_SPEED = 1.875
"""Highest speed of a minimum-jerk move of length 1 in time 1: peak over mean speed."""
PEAK_ACCELERATION = 5.7735
"""Its highest acceleration, 10 / sqrt 3."""
_MOVES_AT_ONCE = 32
"""Largest number of active moves; further goals wait, and the newest is used."""

Values = tuple[float, ...]


def min_jerk(s: float) -> float:
    """Return f(s) = 6 s^5 - 15 s^4 + 10 s^3, clamped outside 0..1 (eq 2, eq 8)."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


class Quintic:
    """Fifth-order polynomial to a resting goal from any position, speed and acceleration.

    From rest it is eq 8, theta0 + (goal - theta0) (6 s^5 - 15 s^4 + 10 s^3).

    coefficients: factors of the powers 0 to 5 of the time since the start
    """

    def __init__(self, start: tuple[float, float, float], goal: float, duration_s: float) -> None:
        p, v, a = start
        T = duration_s
        d = goal - p
        self._goal, self._T = goal, T
        self.coefficients = (
            p,
            v,
            0.5 * a,
            (20.0 * d - 12.0 * v * T - 3.0 * a * T * T) / (2.0 * T**3),
            (-30.0 * d + 16.0 * v * T + 3.0 * a * T * T) / (2.0 * T**4),
            (12.0 * d - 6.0 * v * T - a * T * T) / (2.0 * T**5),
        )

    def state_at(self, t_s: float) -> tuple[float, float, float]:
        """Return position, speed and acceleration at a time since the start."""
        if t_s >= self._T:
            return (self._goal, 0.0, 0.0)
        c0, c1, c2, c3, c4, c5 = self.coefficients
        t = t_s if t_s > 0.0 else 0.0
        return (
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
        )

    def position(self, t_s: float) -> float:
        """Return the position alone, the first value of ``state_at``."""
        if t_s >= self._T:
            return self._goal
        c0, c1, c2, c3, c4, c5 = self.coefficients
        t = t_s if t_s > 0.0 else 0.0
        return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))


class _Move(NamedTuple):
    start_s: float
    duration_s: float
    delta: Values


class MinimumJerkBlend:
    """Several values in motion to the newest goal.

    Position, speed and acceleration are continuous at every moment. With one duration the result is
    a weighted mean of the goals, so it never leaves their range, and its speed never exceeds that
    of a single move over this range: 1.875 x range / duration.

    Args:
        start: initial values.
        duration_s: duration of one move, above 0.
    """

    def __init__(self, start: Values, duration_s: float) -> None:
        self.duration_s = duration_s
        self.reset(start)

    def reset(self, values: Values) -> None:
        """Rest at values immediately."""
        self._values = self._base = self._planned = self._goal = values
        self._moves: list[_Move] = []

    def move_to(self, goal: Values) -> None:
        """Move to another goal, from the next step on; as many values as at the start."""
        if goal != self._goal:  # for an equal goal the tuple is kept, which is cheap to compare
            self._goal = goal

    def step(self, t_s: float) -> Values:
        """Return the values at a time; times must not decrease. At rest it is the same tuple."""
        goal = self._goal
        if goal is not self._planned and goal != self._planned and self._may_start(t_s):
            delta = tuple([b - a for a, b in zip(self._planned, self._goal, strict=True)])
            self._moves.append(_Move(t_s, self.duration_s, delta))
            self._planned = self._goal
        if self._moves:
            self._values = self._sum(t_s)
        return self._values

    @property
    def is_at_rest(self) -> bool:
        """Return whether ``step`` returns the same tuple until there is a new goal."""
        return not self._moves and self._goal == self._planned

    def _may_start(self, t_s: float) -> bool:
        pause_s = self.duration_s / _MOVES_AT_ONCE
        return not self._moves or t_s - self._moves[-1].start_s >= pause_s

    def _sum(self, t_s: float) -> Values:
        """Sum the active moves; finished ones are added to the base."""
        ended = [move for move in self._moves if t_s >= move.start_s + move.duration_s]
        if len(ended) == len(self._moves):
            self._moves = []
            self._base = self._planned
            return self._base
        for move in ended:
            self._moves.remove(move)
            self._base = _add_scaled(self._base, move.delta, 1.0)
        values = self._base
        for move in self._moves:
            values = _add_scaled(
                values, move.delta, min_jerk((t_s - move.start_s) / move.duration_s)
            )
        return values


def _add_scaled(values: Values, delta: Values, factor: float) -> Values:
    return tuple([v + factor * d for v, d in zip(values, delta, strict=True)])

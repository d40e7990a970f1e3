"""Smooth curves of least jerk through key values at their times.

A curve of least integrated squared jerk through given values is a fifth-order spline whose jerk and
snap are continuous at every value it passes (Flash and Hogan 1985; Todorov and Jordan 1998). At a
reversal or a held value, the curve comes to rest (speed and acceleration 0), so that it does not
swing past the chosen extremes. If the curve of least jerk would swing back between two of them, it
passes the values in between more slowly. Any unit; speed and acceleration are per second.
"""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats


class MinimumJerkCurve:
    """A curve from rest through key values to rest at the last of them.

    duration_s: time of the last key

    Args:
        start: the value at time 0.
        times_s: times of the keys, increasing, the first above 0.
        values: values at those times.

    Raises:
        ValueError: the times do not increase from 0.
    """

    def __init__(self, start: float, times_s: Sequence[float], values: Sequence[float]) -> None:
        knots = np.array([0.0, *times_s])
        span = np.diff(knots)
        if len(span) != len(values) or not (span > 0.0).all():
            raise ValueError("the times of the keys must increase from 0, one for each value")
        position = np.array([start, *values])
        speed, acceleration = _states(position, span)
        self._table = _coefficients(span, *_segment_ends(position, speed, acceleration))
        self._rows = [tuple(row) for row in self._table.tolist()]
        self._knots = knots
        self._starts: list[float] = knots[:-1].tolist()
        self.duration_s, self._last = float(knots[-1]), float(position[-1])

    @property
    def times_s(self) -> Floats:
        """Return the times of its keys."""
        return self._knots[1:]

    def value_at(self, t_s: float) -> float:
        """Return the value at a time since the start."""
        if t_s >= self.duration_s:
            return self._last
        i = max(0, bisect_right(self._starts, t_s) - 1)
        c0, c1, c2, c3, c4, c5 = self._rows[i]
        t = max(0.0, t_s - self._starts[i])
        return float(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))))

    def sample_at(self, times_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (n,) values, speeds and accelerations at (n,) times."""
        times = np.clip(times_s, 0.0, None)
        i = np.minimum(
            np.searchsorted(self._knots[:-1], times, side="right") - 1, len(self._rows) - 1
        )
        t = times - self._knots[i]
        c0, c1, c2, c3, c4, c5 = self._table[i].T
        over = times >= self.duration_s
        value = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        speed = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
        acceleration = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))
        return (
            np.where(over, self._last, value),
            np.where(over, 0.0, speed),
            np.where(over, 0.0, acceleration),
        )


def _states(position: Floats, span: Floats) -> tuple[Floats, Floats]:
    """Return speed and acceleration at every key: 0 at reversals and held values.

    Elsewhere those of least jerk, unless the curve would swing back between two stops: then the
    slower of the mean speeds before and after each key, which prevents it.
    """
    step = np.diff(position)
    passed = np.flatnonzero(step[:-1] * step[1:] > 0.0) + 1
    if not len(passed):
        return np.zeros(len(position)), np.zeros(len(position))
    stops = np.ones(len(position) - 2, bool)
    stops[passed - 1] = False
    speed, acceleration = _least_jerk(position, span, stops)
    _, c1, c2, c3, c4, c5 = _coefficients(span, *_segment_ends(position, speed, acceleration)).T
    forward = np.sign(step)
    lowest, highest = np.zeros((2, len(span) + 1))
    for share in np.linspace(0.0, 1.0, 33):
        s = share * span
        rate = c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))
        lowest[:-1] = np.minimum(lowest[:-1], rate * forward)
        highest[:-1] = np.maximum(highest[:-1], np.abs(rate))
    first = np.flatnonzero(np.diff(passed, prepend=-1) > 1)
    last = np.append(first[1:], len(passed)) - 1
    # The segments of each run of passed keys, from the stop before it to the stop after it.
    ends = np.stack((passed[first] - 1, passed[last] + 1), 1).ravel()
    swings = (
        np.minimum.reduceat(lowest, ends)[::2] < -1e-6 * np.maximum.reduceat(highest, ends)[::2]
    )
    slow = passed[np.repeat(swings, last - first + 1)]
    mean = step / span
    speed[slow] = np.minimum(np.abs(mean[slow - 1]), np.abs(mean[slow])) * forward[slow]
    acceleration[slow] = 0.0
    return speed, acceleration


def _least_jerk(position: Floats, span: Floats, stops: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return speed and acceleration at all keys such that jerk and snap are continuous.

    Args:
        position: (n,) values at the keys.
        span: (n - 1,) times between them.
        stops: (n - 2,) whether the curve rests at an inner key.
    """
    count = len(position) - 2
    inner = slice(1, -1)
    speed, acceleration = np.zeros(len(position)), np.zeros(len(position))

    def gaps(unknown: Floats) -> Floats:
        """Return the jumps of jerk and snap at the inner keys; linear in the unknowns."""
        speed[inner], acceleration[inner] = unknown[:count], unknown[count:]
        _, _, _, c3, c4, c5 = _coefficients(span, *_segment_ends(position, speed, acceleration)).T
        jerk = 6.0 * c3 + span * (24.0 * c4 + span * 60.0 * c5)
        snap = 24.0 * c4 + span * 120.0 * c5
        return np.concatenate((jerk[:-1] - 6.0 * c3[1:], snap[:-1] - 24.0 * c4[1:]))

    at_zero = gaps(np.zeros(2 * count))
    keys = np.arange(count)
    # Contributions of the key before, the key itself and the key behind to each key's gaps.
    before, own, behind = blocks = np.zeros((3, count, 2, 2))
    for first in range(3):
        moved = keys[first::3]  # no two of them affect the same gap
        for of in (0, 1):
            probe = np.zeros(2 * count)
            probe[of * count + moved] = 1.0
            jumps = (gaps(probe) - at_zero).reshape(2, count)
            for block, offset in zip(blocks, (1, 0, -1), strict=True):
                gap = moved + offset
                gap = gap[(gap >= 0) & (gap < count)]
                block[gap, :, of] = jumps[:, gap].T
    right = -at_zero.reshape(2, count).T[..., None]
    before[stops], own[stops], behind[stops], right[stops] = 0.0, np.eye(2), 0.0, 0.0
    gaps(_solve(before, own, behind, right).T.ravel())
    return speed, acceleration


def _solve(before: Floats, own: Floats, behind: Floats, right: Floats) -> Floats:
    """Return the solution (n, 2) of a block tridiagonal system by cyclic reduction.

    The system is that of a minimum and so positive definite: no pivot is needed.

    Args:
        before: (n, 2, 2) factors of the unknowns of the key before.
        own: (n, 2, 2) factors of its own unknowns.
        behind: (n, 2, 2) factors of the unknowns of the next key.
        right: (n, 2, 1) right sides.
    """
    if len(own) == 1:
        return np.asarray(np.linalg.solve(own, right)[..., 0], dtype=np.float64)
    if len(own) % 2 == 0:  # append one equation of 0, so that every second one has two neighbours
        zero, one = np.zeros((1, 2, 2)), np.eye(2)[None]
        before, behind = np.concatenate((before, zero)), np.concatenate((behind, zero))
        own, right = np.concatenate((own, one)), np.concatenate((right, np.zeros((1, 2, 1))))
        return _solve(before, own, behind, right)[:-1]
    kept, gone = slice(1, None, 2), slice(0, None, 2)
    there = np.concatenate((before[gone], behind[gone], right[gone]), axis=2)
    reduced = np.linalg.solve(own[gone], there)
    by_before, by_behind, by_right = reduced[..., :2], reduced[..., 2:4], reduced[..., 4:]
    a, c = before[kept], behind[kept]
    inner = _solve(
        -a @ by_before[:-1],
        own[kept] - a @ by_behind[:-1] - c @ by_before[1:],
        -c @ by_behind[1:],
        right[kept] - a @ by_right[:-1] - c @ by_right[1:],
    )
    solution = np.empty((len(own), 2))
    solution[kept] = inner
    padded = np.concatenate((np.zeros((1, 2)), inner, np.zeros((1, 2))))[..., None]
    solution[gone] = (by_right - by_before @ padded[:-1] - by_behind @ padded[1:])[..., 0]
    return solution


def _segment_ends(position: Floats, speed: Floats, acceleration: Floats) -> tuple[Floats, ...]:
    """Return the states before and after every segment, as ``_coefficients`` takes them."""
    before = position[:-1], speed[:-1], acceleration[:-1]
    return *before, position[1:], speed[1:], acceleration[1:]


def _coefficients(
    span: Floats, p0: Floats, v0: Floats, a0: Floats, p1: Floats, v1: Floats, a1: Floats
) -> Floats:
    """Return the (n, 6) coefficients of fifth-order polynomials between two states each."""
    d, T = p1 - p0, span
    return np.stack(
        (
            p0,
            v0,
            0.5 * a0,
            (20.0 * d - (8.0 * v1 + 12.0 * v0) * T - (3.0 * a0 - a1) * T * T) / (2.0 * T**3),
            (-30.0 * d + (14.0 * v1 + 16.0 * v0) * T + (3.0 * a0 - 2.0 * a1) * T * T)
            / (2.0 * T**4),
            (12.0 * d - 6.0 * (v1 + v0) * T + (a1 - a0) * T * T) / (2.0 * T**5),
        ),
        axis=1,
    )

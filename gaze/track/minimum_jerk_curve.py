"""Smooth curves of least jerk through key values at their times.

A curve of least integrated squared jerk through given values is a fifth-order spline whose jerk and
snap are continuous at every value it passes (Flash and Hogan 1985; Todorov and Jordan 1998). At a
reversal or a held value, the curve comes to rest (speed and acceleration 0), so that it does not
swing past the chosen extremes. If the curve of least jerk would swing back between two of them, it
passes the values in between more slowly. Any unit; speed and acceleration are per second.
"""

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats

_SHARES = np.linspace(0.0, 1.0, 33)[:, None]
"""Places within a segment at which its direction is checked."""


def key_states(times_s: Floats, values: Floats, start: float = 0.0) -> tuple[Floats, Floats]:
    """Return the states of a curve from rest at a value through keys to rest at the last of them.

    Args:
        times_s: (n,) Times of the keys, increasing, the first above 0.
        values: (n,) Values at those times.
        start: Value at time 0.

    Returns:
        (n + 1,) times from 0, and (3, n + 1) values, speeds and accelerations.
    """
    knots, position = np.append(0.0, times_s), np.append(start, values)
    return knots, np.stack((position, *_states(position, np.diff(knots))))


def evaluate(knots: Floats, states: Floats, times_s: Floats) -> Floats:
    """Return the states at (k,) times of curves through (3, ..., n) states at (n,) knots."""
    at = np.clip(times_s, knots[0], knots[-1])
    i = np.searchsorted(knots[1:-1], at, side="right")
    table = _coefficients(knots[i + 1] - knots[i], states[..., i], states[..., i + 1])
    return np.stack(_evaluate(table, at - knots[i]))


def _evaluate(coefficients: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Return value, speed and acceleration of polynomials."""
    c0, c1, c2, c3, c4, c5 = coefficients
    return (
        c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
        c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
        2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
    )


def _states(position: Floats, span: Floats) -> tuple[Floats, Floats]:
    """Return speed and acceleration at every key: 0 at reversals and held values.

    Elsewhere those of least jerk, unless the curve would swing back between two stops: then the
    slower of the mean speeds before and after each key, which prevents it.
    """
    mean = np.diff(position) / span
    stops = np.concatenate(([True], mean[:-1] * mean[1:] <= 0.0, [True]))
    if stops.all():
        return np.zeros(len(position)), np.zeros(len(position))
    speed, acceleration = _least_jerk(position, span, stops)
    states = np.stack((position, speed, acceleration))
    table = _coefficients(span, states[:, :-1], states[:, 1:])
    rate = _evaluate(table, _SHARES * span)[1] * np.sign(mean)
    first = np.flatnonzero(stops)[:-1]  # of the segments from one stop to the next
    lowest = np.minimum.reduceat(rate.min(axis=0), first)
    swings = lowest < -1e-6 * np.maximum.reduceat(rate.max(axis=0), first)
    slow = ~stops & np.append(np.repeat(swings, np.diff(np.flatnonzero(stops))), False)
    slower = np.minimum(np.abs(mean[:-1]), np.abs(mean[1:])) * np.sign(mean[1:])
    speed[slow], acceleration[slow] = slower[slow[1:-1]], 0.0
    return speed, acceleration


def _least_jerk(position: Floats, span: Floats, stops: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return speed and acceleration at all keys such that jerk and snap are continuous.

    Jerk and snap at both ends of a segment are linear in the states there, so every key gives two
    equations in the states before, at and after it; they are solved key by key.

    Args:
        position: (n,) values at the keys.
        span: (n - 1,) times between them.
        stops: (n,) whether the curve rests at a key.
    """
    states = np.zeros((len(position), 2))
    d, e = np.diff(position)[:-1], np.diff(position)[1:]
    s, t = span[:-1], span[1:]
    blocks = np.array(
        [
            [[-24.0 / s**2, -3.0 / s], [-168.0 / s**3, -24.0 / s**2]],
            [
                [36.0 / t**2 - 36.0 / s**2, 9.0 / s + 9.0 / t],
                [-192.0 / s**3 - 192.0 / t**3, 36.0 / s**2 - 36.0 / t**2],
            ],
            [[24.0 / t**2, -3.0 / t], [-168.0 / t**3, 24.0 / t**2]],
        ]
    )
    before, own, behind = blocks.transpose(0, 3, 1, 2)
    right = np.stack((60.0 * (e / t**3 - d / s**3), -360.0 * (e / t**4 + d / s**4)), 1)
    passed = np.flatnonzero(~stops)
    for i in passed - 1:
        if not stops[i]:
            factor = before[i] @ np.linalg.inv(own[i - 1])
            own[i] -= factor @ behind[i - 1]
            right[i] -= factor @ right[i - 1]
    for i in passed[::-1]:
        states[i] = np.linalg.solve(own[i - 1], right[i - 1] - behind[i - 1] @ states[i + 1])
    return states[:, 0], states[:, 1]


def _coefficients(T: Floats, begin: Floats, end: Floats) -> Floats:
    """Return the coefficients of fifth-order polynomials between two states in a time."""
    (p, v0, a0), (q, v1, a1) = begin, end
    d = q - p
    return np.stack(
        (
            p,
            v0,
            0.5 * a0,
            (20.0 * d - (8.0 * v1 + 12.0 * v0) * T - (3.0 * a0 - a1) * T * T) / (2.0 * T**3),
            (-30.0 * d + (14.0 * v1 + 16.0 * v0) * T + (3.0 * a0 - 2.0 * a1) * T * T)
            / (2.0 * T**4),
            (12.0 * d - 6.0 * (v1 + v0) * T + (a1 - a0) * T * T) / (2.0 * T**5),
        )
    )

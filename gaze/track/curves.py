"""Smooth curves through key values at their times.

Between two keys every value is a polynomial of fifth order (Flash and Hogan 1985: least jerk from
rest to rest), here as a Bezier curve. At a reversal, a held value and both ends it rests. Elsewhere
it passes a key at the speed of a parabola through it and its neighbours, but at most so fast that
the control points of the curve do not turn back: then the curve does not either.
"""

import numpy as np

from gazerig.gaze.types import Floats

_MOST_OF_MEAN = 1.25
"""Largest speed at a key as a share of the slower mean speed beside it: 2/5 of the sum of both
speeds of a segment is less than its mean speed, so its control points are in order."""


def key_states(times_s: Floats, values: Floats) -> Floats:
    """Return the (3, n) values, speeds and accelerations at n keys from rest to rest."""
    mean = np.diff(values) / np.diff(times_s)
    slower = np.minimum(np.abs(mean[:-1]), np.abs(mean[1:])) * (mean[:-1] * mean[1:] > 0.0)
    most = _MOST_OF_MEAN * np.pad(slower, 1)
    speed = np.clip(np.gradient(values, times_s), -most, most)
    return np.stack((values, speed, np.zeros(len(values))))


class Curves:
    """Curves of several values through common knots; before and behind them they rest.

    Args:
        knots_s: (n,) increasing times.
        states: (3, n, values) values, speeds and accelerations at these times.
    """

    def __init__(self, knots_s: Floats, states: Floats) -> None:
        self._knots_s, self._spans_s = knots_s, np.diff(knots_s)[:, None]
        spans_s = self._spans_s
        scales = np.stack((np.ones_like(spans_s), spans_s / 5.0, spans_s**2 / 20.0))
        start, leaves, bends = states[:, :-1] * scales
        end, arrives, unbends = states[:, 1:] * scales
        self._points = np.stack(
            (start, start + leaves, start + 2.0 * leaves + bends,
             end - 2.0 * arrives + unbends, end - arrives, end)
        )  # fmt: skip

    def sample(self, times_s: Floats) -> Floats:
        """Return (3, k, values) values, speeds and accelerations at (k,) times."""
        i = np.searchsorted(self._knots_s[1:-1], times_s, side="right")
        spans_s, points = self._spans_s[i], self._points[:, i]
        share = np.clip((times_s - self._knots_s[i])[:, None] / spans_s, 0.0, 1.0)
        for _ in range(3):  # de Casteljau's algorithm
            points = points[:-1] + share * (points[1:] - points[:-1])
        bend = points[2] - 2.0 * points[1] + points[0]
        first, second = points[:-1] + share * (points[1:] - points[:-1])
        slope = second - first
        return np.stack((first + share * slope, 5.0 * slope / spans_s, 20.0 * bend / spans_s**2))

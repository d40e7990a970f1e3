"""Key frames of a sampled motion.

A densely sampled motion becomes few keys with minimum-jerk curves between. It is smoothed first.
Keys are placed at its turning points, and at further points until the curve through the keys
deviates by less than a tolerance.
"""

from itertools import pairwise

import numpy as np

from gazerig.gaze.track.minimum_jerk_curve import evaluate, key_states
from gazerig.gaze.turning_points import turning_points
from gazerig.gaze.types import Floats

GRID_S = 0.02
"""Grid of the keys' times."""
_SMOOTHED_OVER_S = 0.15
_MOST_KEYS = 60
"""Keys between two reversals, in a minute."""
_WINDOW = round(60.0 / GRID_S)
_STILL, _HOLD = 1e-4, round(0.1 / GRID_S)
"""Change between samples of a constant value, and the shortest number of them."""


def smooth(times_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return samples at even times without the jitter of a hand and of encoders.

    Args:
        times_s: (n,) Increasing times; the first counts as 0.
        values: (n,) Values.

    Returns:
        Times in steps of ``GRID_S`` from 0, and values by a local cubic (Savitzky and Golay
        1964), which keeps peaks that a mean would flatten.
    """
    even = np.arange(0.0, times_s[-1] - times_s[0] + 1e-9, GRID_S)
    found = np.interp(even, times_s - times_s[0], values)
    window = min(2 * round(_SMOOTHED_OVER_S / GRID_S / 2.0) + 1, len(found) - (len(found) + 1) % 2)
    if window <= 3:
        return even, found
    half = window // 2
    weights = np.linalg.pinv(np.vander(np.arange(-half, half + 1.0), 4))[-1]  # symmetric
    return even, np.convolve(np.pad(found, half, mode="edge"), weights, mode="valid")


def resample(times_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return samples at even times, as ``smooth``, on a cubic curve through the given ones."""
    even = np.arange(0.0, times_s[-1] - times_s[0] + 1e-9, GRID_S)
    i = np.clip(np.searchsorted(times_s - times_s[0], even, side="right") - 1, 0, len(times_s) - 2)
    rate = np.gradient(values, times_s)
    span = times_s[i + 1] - times_s[i]
    s = np.minimum((even - times_s[i] + times_s[0]) / span, 1.0)
    return even, (
        values[i] * (1.0 + 2.0 * s) * (1.0 - s) ** 2
        + values[i + 1] * s * s * (3.0 - 2.0 * s)
        + span * s * (1.0 - s) * (rate[i] * (1.0 - s) - rate[i + 1] * s)
    )


def fit_keys(times_s: Floats, values: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """Return times and values of keys whose curve stays within a tolerance of the samples.

    The curve stops where the samples reverse or hold, so the parts between two stops are
    independent: the time needed grows with the length of the samples, not with its square.

    Args:
        times_s: (n,) Times in steps of ``GRID_S`` from 0.
        values: (n,) Values; the first one is rest.
        tolerance: Largest distance of the curve from the samples.

    Returns:
        Keys after time 0; none if nothing moves by more than the tolerance.
    """
    if np.abs(values - values[0]).max() <= tolerance:
        return np.zeros(0), np.zeros(0)
    chosen: list[int] = []
    ends = {0, len(values) - 1}
    stops = ends.union(turning_points(values, tolerance), _hold_ends(values))
    for first, last in pairwise(sorted(stops)):
        part = slice(first, last + 1)
        inner = _inner_keys(times_s[part] - times_s[first], values[part], tolerance)
        chosen += [first + i for i in inner]
    return times_s[chosen], values[chosen]


def _hold_ends(values: Floats) -> list[int]:
    """Return the first and last indices of parts at a constant value."""
    still = np.abs(np.diff(values)) < _STILL
    edges = np.flatnonzero(np.diff(np.concatenate(([False], still, [False])).astype(int)))
    return [int(i) for a, b in edges.reshape(-1, 2) if b - a >= _HOLD for i in (a, b)]


def _inner_keys(times_s: Floats, values: Floats, tolerance: float) -> list[int]:
    """Return the indices of the keys between two stops, and the last."""
    chosen = [len(values) - 1]
    for _ in range(_MOST_KEYS):
        states = key_states(times_s[chosen], values[chosen], float(values[0]))
        error = np.abs(evaluate(*states, times_s)[0] - values)
        if error.max() <= tolerance:
            break
        error[[0, *chosen]] = 0.0
        # One key in each window of a minute that needs one.
        windows = range(0, len(error), _WINDOW)
        worst = [first + int(error[first : first + _WINDOW].argmax()) for first in windows]
        chosen = sorted({*chosen, *(i for i in worst if error[i] > tolerance)})
    return chosen

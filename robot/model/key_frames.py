"""Fit of key frames to a densely sampled motion: few keys with minimum-jerk curves between.

The sampled motion is smoothed first. Keys are placed at its turning points, and at further points
until the curve through the keys deviates by less than a tolerance.
"""

import numpy as np

from gazerig.gaze.gesture.minimum_jerk_curve import MinimumJerkCurve
from gazerig.gaze.types import Floats

GRID_S = 0.02
"""Grid of the keys' times."""
_SMOOTHED_OVER_S = 0.15
_MOST_KEYS = 60


def smoothed(times_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return samples at even times without the jitter of a hand and of encoders.

    Args:
        times_s: (n,) Increasing times; the first counts as 0.
        values: (n,) Values.

    Returns:
        Times in steps of ``GRID_S`` from 0, and values by a local cubic (Savitzky and Golay
        1964), which keeps peaks that a mean would flatten.
    """
    from scipy.signal import savgol_filter  # nearly a second of processor

    even = np.arange(0.0, times_s[-1] - times_s[0] + 1e-9, GRID_S)
    found = np.interp(even, times_s - times_s[0], values)
    window = min(2 * round(_SMOOTHED_OVER_S / GRID_S / 2.0) + 1, len(found) - (len(found) + 1) % 2)
    return even, savgol_filter(found, window, 3, mode="nearest") if window > 3 else found


def fit_keys(times_s: Floats, values: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """Return times and values of keys whose curve stays within a tolerance of the samples.

    Args:
        times_s: (n,) Times in steps of ``GRID_S`` from 0.
        values: (n,) Values; the first one is rest.
        tolerance: Largest distance of the curve from the samples.

    Returns:
        Keys after time 0; none if nothing moves by more than the tolerance.
    """
    if np.abs(values - values[0]).max() <= tolerance:
        return np.zeros(0), np.zeros(0)
    chosen = _turns(values, tolerance)
    while len(chosen) < _MOST_KEYS:
        curve = MinimumJerkCurve(
            float(values[0]), times_s[chosen].tolist(), values[chosen].tolist()
        )
        error = np.abs(curve.sampled(times_s)[0] - values)
        if error.max() <= tolerance:
            break
        error[[0, *chosen]] = 0.0
        chosen = sorted({*chosen, int(error.argmax())})
    return times_s[chosen], values[chosen]


def _turns(values: Floats, tolerance: float) -> list[int]:
    """Return the indices at which the samples reverse by more than the tolerance, and the last."""
    turns: list[int] = []
    high = low = 0
    heading = 0
    for i, value in enumerate(values):
        high = i if value > values[high] else high
        low = i if value < values[low] else low
        if heading >= 0 and values[high] - value > tolerance:
            turns += [high] if high and heading else []
            heading, low = -1, i
        elif heading <= 0 and value - values[low] > tolerance:
            turns += [low] if low and heading else []
            heading, high = 1, i
    return sorted({*turns, len(values) - 1})

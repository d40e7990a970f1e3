"""Key frames fitted to motion that was sampled densely: few keys, least-jerk curves between.

A sampled motion is smoothed first. Its keys are where it turns, and wherever else the curve
through the keys would be farther from it than a tolerance.
"""

import numpy as np

from gazerig.gaze.gesture.minimum_jerk_curve import MinimumJerkCurve
from gazerig.gaze.types import Floats

GRID_S = 0.02
"""Keys lie on whole multiples of this."""
_SMOOTHED_OVER_S = 0.15
_MOST_KEYS = 60


def smoothed(times_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return samples at even times without the jitter of a hand and of encoders.

    Args:
        times_s: (n,), increasing; the first counts as 0.
        values: (n,).

    Returns:
        Times in steps of ``GRID_S`` from 0, and values by a local cubic (Savitzky and Golay
        1964), which keeps peaks where a mean would flatten them.
    """
    from scipy.signal import savgol_filter  # nearly a second of processor

    even = np.arange(0.0, times_s[-1] - times_s[0] + 1e-9, GRID_S)
    found = np.interp(even, times_s - times_s[0], values)
    window = min(2 * round(_SMOOTHED_OVER_S / GRID_S / 2.0) + 1, len(found) - (len(found) + 1) % 2)
    return even, savgol_filter(found, window, 3, mode="nearest") if window > 3 else found


def fitted_keys(times_s: Floats, values: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """Return times and values of the keys whose curve stays within a tolerance of samples.

    Args:
        times_s: (n,) in steps of ``GRID_S`` from 0.
        values: (n,), the first one is rest.
        tolerance: largest distance of the curve from the samples.

    Returns:
        Keys after time 0; none where nothing moves by more than the tolerance.
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
    """Return where the samples turn back by more than the tolerance, and their end."""
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

"""Few keys for a motion that was sampled densely, by hand or by an animation program."""

from itertools import pairwise

import numpy as np
from scipy.signal import find_peaks, savgol_filter

from gazerig.gaze.track.curves import Curves, key_states
from gazerig.gaze.types import Floats

GRID_S = 0.02
"""Grid of the keys' times."""
_SMOOTHED = 9
"""Samples over which a local cubic (Savitzky and Golay 1964) removes the jitter of a hand and of
encoders; it keeps peaks that a mean would flatten."""


def fit_keys(times_s: Floats, values: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """Return keys whose curve stays within a tolerance of smoothed samples.

    The keys are the turning points. Each segment that deviates too much gets another one at its
    worst place, until none does.

    Args:
        times_s: (n,) Increasing times of the samples.
        values: (n,) Values; the motion rests at both ends.
        tolerance: Largest distance of the curve from the smoothed samples.

    Returns:
        Times and values of the keys, the first and the last sample among them.
    """
    even_s = np.arange(times_s[0], times_s[-1] + 1e-9, GRID_S)
    smooth = np.interp(even_s, times_s, values)
    smooth = savgol_filter(smooth, _SMOOTHED, 3, mode="nearest")
    turns = [find_peaks(sign * smooth, prominence=tolerance)[0] for sign in (1.0, -1.0)]
    keys = {0, len(smooth) - 1, *np.concatenate(turns).tolist()}
    while True:
        at = sorted(keys)
        states = key_states(even_s[at], smooth[at])
        error = np.abs(Curves(even_s[at], states[:, :, None]).sample(even_s)[0, :, 0] - smooth)
        worst = [int(a + error[a:b].argmax()) for a, b in pairwise(at)]
        more = {i for i in worst if error[i] > tolerance}
        if not more:
            return even_s[at], smooth[at]
        keys |= more

"""Random parts of blinking: intervals, gaze-evoked blinks, depth, double blinks."""

from math import exp, inf, log, sqrt

import numpy as np

from gazerig.gaze.lids.lid_params import LidParams

_NEARLY_SHUT = 0.95
"""Depth above which a blink counts as complete."""


def blink_pause_s(
    params: LidParams, per_min: float, length_s: float, rng: np.random.Generator
) -> float:
    """Draw the pause from the end of a blink until the next spontaneous one.

    per_min: wanted rate of blinks, 1/min, 0 is never; length_s: of a blink
    """
    if per_min == 0.0:
        return inf
    shortest = params.min_interval_ms / 1e3
    between = 60.0 / per_min - length_s
    mean = max(between - shortest, 0.05)
    if params.interval_distribution == "fixed":
        return shortest + mean
    if params.interval_distribution == "exponential":
        return shortest + mean * float(rng.standard_exponential())
    # A log-normal part on top of the shortest pause, with mean and spread such that the whole pause
    # has the wanted ones.
    sigma2 = log(1.0 + (params.interval_cv * between / mean) ** 2)
    return shortest + mean * exp(sqrt(sigma2) * rng.standard_normal() - 0.5 * sigma2)


def evokes_blink(params: LidParams, shift_deg: float, rng: np.random.Generator) -> bool:
    """Return whether a gaze shift evokes a blink (Evinger 1994).

    The logistic curve through the published points would evoke a blink in one of twenty shifts of 3
    deg; it is lowered such that it begins at ``gaze_evoked_blink_least_deg``, and 1 stays 1.
    """
    if params.gaze_evoked_blink_literal:
        return shift_deg > params.gaze_evoked_blink_literal_deg
    if shift_deg <= params.gaze_evoked_blink_least_deg:
        return False
    least = _logistic(params, params.gaze_evoked_blink_least_deg)
    chance = (_logistic(params, shift_deg) - least) / max(1.0 - least, 1e-9)
    return float(rng.random()) < chance


def _logistic(params: LidParams, shift_deg: float) -> float:
    beyond = shift_deg - params.gaze_evoked_blink_middle_deg
    # At the steepest slope the exponential would overflow.
    return 1.0 / (1.0 + exp(min(700.0, -params.gaze_evoked_blink_steepness_1_deg * beyond)))


def evoked_offset_s(params: LidParams, rng: np.random.Generator) -> float:
    """Draw the time from the onset of a gaze shift to that of its blink, negative before it.

    The two typically begin together (Evinger 1994), the muscle of the lids some tens of ms sooner
    or later than eyes and head: a normal distribution, cut off at twice its deviation.
    """
    sd_s = params.gaze_evoked_blink_jitter_ms / 1e3
    if sd_s == 0.0:
        return 0.0
    return sd_s * min(2.0, max(-2.0, float(rng.standard_normal())))


def blink_depth(params: LidParams, rng: np.random.Generator) -> float:
    """Draw the depth of a blink, 1 is complete closure; of incomplete ones most are nearly so."""
    if rng.random() >= params.incomplete_share:
        return 1.0
    least = min(params.incomplete_least, _NEARLY_SHUT)
    return least + (_NEARLY_SHUT - least) * sqrt(float(rng.random()))


def is_double_blink(params: LidParams, rng: np.random.Generator) -> bool:
    """Return whether a second blink follows immediately."""
    return float(rng.random()) < params.double_share

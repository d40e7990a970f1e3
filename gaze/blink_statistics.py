"""Random parts of blinking: intervals, gaze-evoked blinks, depth, double blinks."""

from math import exp, inf, log, sqrt

import numpy as np

from gazerig.gaze.lid_params import LidParams


def blink_pause_s(
    params: LidParams, per_min: float, length_s: float, rng: np.random.Generator
) -> float:
    """Draw the pause from the end of a blink until the next spontaneous one.

    per_min: blinks wanted in a minute, 0 is never; length_s: of a blink
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
    # A log-normal part on top of the shortest pause, with mean and spread such that
    # the whole pause has those asked for.
    sigma2 = log(1.0 + (params.interval_cv * between / mean) ** 2)
    return shortest + mean * exp(sqrt(sigma2) * rng.standard_normal() - 0.5 * sigma2)


def evokes_blink(params: LidParams, shift_deg: float, rng: np.random.Generator) -> bool:
    """Return whether a gaze shift brings a blink with it (Evinger 1994)."""
    if params.gaze_evoked_blink_literal:
        return shift_deg > params.gaze_evoked_blink_literal_deg
    beyond = shift_deg - params.gaze_evoked_blink_middle_deg
    # Of the steepest slope the exponential would be beyond what a number can hold.
    against = exp(min(700.0, -params.gaze_evoked_blink_steepness_1_deg * beyond))
    return float(rng.random()) < 1.0 / (1.0 + against)


def blink_depth(params: LidParams, rng: np.random.Generator) -> float:
    """Draw the depth of a blink: 1 is complete closure."""
    shallow = rng.random() < params.incomplete_share
    return float(rng.uniform(0.70, 0.85)) if shallow else 1.0


def is_double_blink(params: LidParams, rng: np.random.Generator) -> bool:
    """Return whether a second blink comes right after this one."""
    return float(rng.random()) < params.double_share

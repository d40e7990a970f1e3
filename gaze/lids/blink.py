"""Blinks and winks: closure over time, intervals, gaze-evoked blinks, depth, double blinks.

A lid closes fast, holds, and opens more slowly. Closing is about twice as fast as opening
(VanderWerf 2003; Kwon 2013). A closing continues unchanged to its end even if parameters change
meanwhile.
"""

from math import exp, inf, log, sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.lids.lid_params import LidParams
from gazerig.gaze.minimum_jerk import min_jerk


def closure(since_onset_s: float, close_s: float, hold_s: float, open_s: float) -> float:
    """Return the closure of a lid, 0..1, at a time after the onset of a blink or wink."""
    if since_onset_s <= 0.0 or since_onset_s >= close_s + hold_s + open_s:
        return 0.0
    if since_onset_s < close_s:
        return min_jerk(since_onset_s / close_s)
    if since_onset_s < close_s + hold_s:
        return 1.0
    # Opening starts quickly and ends in a long tail: minimum jerk in a time that runs fast at
    # first.
    s = (since_onset_s - close_s - hold_s) / open_s
    # Just before its end the polynomial exceeds 1 by a rounding error.
    return max(0.0, 1.0 - min_jerk(1.0 - (1.0 - s) ** 1.4))


class LidClosure(NamedTuple):
    """One blink or wink.

    onset_s: its start; close_s, hold_s, open_s: its durations at no sleepiness
    lower_share: relative stroke of the lower lid
    depth: relative stroke of both lids, 1 is shut
    slowness: factor of these durations
    """

    onset_s: float
    close_s: float
    hold_s: float
    open_s: float
    lower_share: float
    depth: float = 1.0
    slowness: float = 1.0

    @property
    def length_s(self) -> float:
        """Return the total duration."""
        return self.slowness * (self.close_s + self.hold_s + self.open_s)

    def is_in_progress(self, t_s: float) -> bool:
        """Return whether it is in progress."""
        return self.onset_s <= t_s < self.onset_s + self.length_s

    def closure_at(self, t_s: float) -> float:
        """Return the closure of the upper lid, 0..1; the lower lid's is lower_share of it."""
        since_s = (t_s - self.onset_s) / self.slowness
        return self.depth * closure(since_s, self.close_s, self.hold_s, self.open_s)

    def eye_turn(self, t_s: float) -> float:
        """Return the turn of the eyes with it, 0..1: it ends before that of the lids."""
        since_s = (t_s - self.onset_s) / self.slowness
        out_s = _EYES_OUT * self.close_s
        back_s = self.close_s - out_s + self.hold_s + _EYES_BACK * self.open_s
        if not 0.0 < since_s < out_s + back_s:
            return 0.0
        if since_s < out_s:
            return self.depth * min_jerk(since_s / out_s)
        return self.depth * (1.0 - min_jerk((since_s - out_s) / back_s))

    def vary_durations(self, params: LidParams, rng: np.random.Generator) -> "LidClosure":
        """Return it with randomly varied durations."""
        if params.duration_spread == 0.0:
            return self
        close, hold, open = np.exp(params.duration_spread * rng.standard_normal(3)).tolist()
        return self._replace(
            close_s=close * self.close_s, hold_s=hold * self.hold_s, open_s=open * self.open_s
        )

    def left_and_right(
        self, params: LidParams, rng: np.random.Generator
    ) -> "tuple[LidClosure, LidClosure]":
        """Return it for the left and the right lids, which differ slightly."""
        if params.asymmetry == 0.0:
            return self, self
        open, depth = (0.5 * params.asymmetry * rng.standard_normal(2)).tolist()
        if self.depth >= 1.0:  # both eyes shut, at the same time
            depth = 0.0
        left, right = (
            self._replace(
                open_s=self.open_s * max(0.5, 1.0 + sign * open),
                depth=min(max(self.depth * (1.0 + sign * depth), 0.0), 1.0),
            )
            for sign in (1.0, -1.0)
        )
        return left, right


_EYES_OUT, _EYES_BACK = 0.9, 0.6
"""Shares of the lids' closing and opening times: end of the eyes' turn out, and back."""

_NEARLY_SHUT = 0.95
"""Depth above which a blink counts as complete."""


def blink_pause_s(
    params: LidParams, per_min: float, length_s: float, rng: np.random.Generator
) -> float:
    """Draw the pause from the end of a blink until the next spontaneous one.

    per_min: wanted rate of blinks, 1/min, 0 means never; length_s: duration of a blink
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
    """Draw the depth of a blink, 1 is complete; most incomplete blinks are nearly complete."""
    if rng.random() >= params.incomplete_share:
        return 1.0
    least = min(params.incomplete_least, _NEARLY_SHUT)
    return least + (_NEARLY_SHUT - least) * sqrt(float(rng.random()))


def is_double_blink(params: LidParams, rng: np.random.Generator) -> bool:
    """Return whether a second blink follows immediately."""
    return float(rng.random()) < params.double_share

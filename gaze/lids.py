"""Lids: spontaneous and gaze-evoked blinks, and lids that follow the vertical gaze.

Closing is about twice as fast as opening (VanderWerf 2003; Kwon 2013). Rates are those
of Bentivoglio 1997: 17 a minute at rest, 26 in conversation, with log-normal
intervals. Large gaze shifts bring a blink with them (Evinger 1994: 97 % of those
beyond 33 deg), once for each shift. Opening 0 is shut, 1 is fully open.
"""

from dataclasses import dataclass, field
from math import degrees, exp, log, sqrt

import numpy as np

from gaze.saccade import min_jerk


@dataclass(frozen=True)
class LidParams:
    """Rates and shapes."""

    blinks_per_min: float = field(
        default=20.0,
        metadata={
            "low": 0.0,
            "high": 60.0,
            "unit": "1/min",
            "says": "spontaneous blinks; people: 17 at rest, 26 in conversation; 0 is never",
        },
    )
    interval_cv: float = field(
        default=0.8,
        metadata={
            "low": 0.05,
            "high": 3.0,
            "unit": "",
            "says": "spread of the intervals: standard deviation over mean",
        },
    )
    shortest_interval_ms: float = field(
        default=1000.0,
        metadata={"low": 400.0, "high": 10000.0, "unit": "ms", "says": "pause after a blink"},
    )
    close_ms: float = field(
        default=75.0,
        metadata={"low": 30.0, "high": 500.0, "unit": "ms", "says": "time of closing"},
    )
    hold_ms: float = field(
        default=35.0,
        metadata={"low": 0.0, "high": 1000.0, "unit": "ms", "says": "time shut"},
    )
    open_ms: float = field(
        default=175.0,
        metadata={"low": 50.0, "high": 1500.0, "unit": "ms", "says": "time of opening"},
    )
    rest_opening: float = field(
        default=0.75,
        metadata={"low": 0.1, "high": 1.0, "unit": "", "says": "opening with level gaze"},
    )
    follow_per_deg: float = field(
        default=0.012,
        metadata={
            "low": 0.0,
            "high": 0.1,
            "unit": "1/deg",
            "says": "change of the opening with vertical gaze",
        },
    )
    evoked_middle_deg: float = field(
        default=17.0,
        metadata={
            "low": 1.0,
            "high": 180.0,
            "unit": "deg",
            "says": "gaze shift that brings a blink every second time",
        },
    )
    evoked_steepness_1_deg: float = field(
        default=0.217,
        metadata={"low": 0.0, "high": 5.0, "unit": "1/deg", "says": "slope of that probability"},
    )


class Lids:
    """Opening of both lids as a function of time, with its own dice."""

    def __init__(self, params: LidParams, rng: np.random.Generator) -> None:
        """Take rates, shapes and dice."""
        self._params = params
        self._rng = rng
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Open the lids and draw the first blink."""
        self.blinks = 0
        self._onset_s = float("-inf")
        self._next_s = t_s + self._interval_s()

    def step(
        self, t_s: float, eye_pitch_rad: float, shift_rad: float | None
    ) -> tuple[float, float, bool]:
        """Give the opening of the left and right lid and whether a blink is under way.

        shift_rad: size of a gaze shift that begins in this very tick, else None
        """
        if self._due(t_s, shift_rad):
            self._onset_s = t_s
            self.blinks += 1
            self._next_s = t_s + self._length_s() + self._interval_s()
        closure = self.closure(t_s - self._onset_s)
        par = self._params
        follow = par.rest_opening + par.follow_per_deg * degrees(eye_pitch_rad)
        opening = min(1.0, max(0.0, follow)) * (1.0 - closure)
        return opening, opening, closure > 0.0

    def closure(self, since_onset_s: float) -> float:
        """Give how far a blink has shut the lid, 0..1, a time after its onset."""
        par = self._params
        close, hold, opening = par.close_ms / 1e3, par.hold_ms / 1e3, par.open_ms / 1e3
        if since_onset_s <= 0.0 or since_onset_s >= close + hold + opening:
            return 0.0
        if since_onset_s < close:
            return min_jerk(since_onset_s / close)
        if since_onset_s < close + hold:
            return 1.0
        # Opening sets off quickly and ends in a long tail: minimum jerk in a time that
        # runs fast at first.
        s = (since_onset_s - close - hold) / opening
        return 1.0 - min_jerk(1.0 - (1.0 - s) ** 1.4)

    def _due(self, t_s: float, shift_rad: float | None) -> bool:
        """Tell whether a blink begins now; the dice of a shift are thrown once."""
        if shift_rad is not None:
            par = self._params
            beyond = degrees(shift_rad) - par.evoked_middle_deg
            chance = 1.0 / (1.0 + exp(-par.evoked_steepness_1_deg * beyond))
            if self._rng.random() < chance and t_s - self._onset_s > 0.6:
                return True
        return t_s >= self._next_s

    def _length_s(self) -> float:
        par = self._params
        return (par.close_ms + par.hold_ms + par.open_ms) / 1e3

    def _interval_s(self) -> float:
        """Draw the pause until the next spontaneous blink."""
        par = self._params
        if par.blinks_per_min == 0.0:
            return float("inf")
        shortest = par.shortest_interval_ms / 1e3
        between = 60.0 / par.blinks_per_min - self._length_s()
        mean = max(between - shortest, 0.05)
        # A log-normal part on top of the shortest pause, with mean and spread such that
        # the whole pause has those asked for.
        sigma2 = log(1.0 + (par.interval_cv * between / mean) ** 2)
        return shortest + mean * exp(sqrt(sigma2) * self._rng.standard_normal() - 0.5 * sigma2)

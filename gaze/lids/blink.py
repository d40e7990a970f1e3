"""Blinks and winks: closure over time, intervals, gaze-evoked blinks, depth.

Rates are those of Bentivoglio 1997: 17 a minute at rest, 26 in conversation, with log-normal
intervals. A lid closes fast, holds, and opens more slowly: closing is about twice as fast as
opening (VanderWerf 2003; Kwon 2013). Half of all blinks are incomplete. Large gaze shifts evoke a
blink (Evinger 1994: 97 % of those beyond 33 deg), once for each shift, about when eyes and head
start; the published rates include these.

No two blinks of a person are equal: durations differ by tens of ms, half of the blinks stop between
a quarter and nearly all of the path (Ousler 2014). Two small things that nobody sees are left out:
the eyes' turn in a blink (1 to 2 deg, Riggs 1987) and the difference between left and right lids.

People's lower lids hardly rise in a blink: they move towards the nose (Doane 1980), and the upper
lid moves down to them. A mechanism cannot do this: the shut points of its lids are calibrated to
meet, perhaps in the middle, so a lower lid at rest would leave a gap, and both lids close alike.

A closing continues unchanged to its end even if parameters change meanwhile.
"""

from dataclasses import dataclass
from math import exp, inf, sqrt
from typing import Annotated, Literal, NamedTuple

import numpy as np

from gazerig.gaze.draws import draw_lognormal
from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.params import Bounds


@dataclass(frozen=True)
class LidParams:
    """Law, rate and shape of blinks, and rest position of the lids."""

    # fmt: off
    blinks_per_min: Annotated[float, Bounds(0, 60), "spontaneous blinks at rest, half as many again in conversation; 0: never"] = 17.0
    close_ms: Annotated[float, Bounds(30, 500), "duration of closing in a blink"] = 75.0
    hold_ms: Annotated[float, Bounds(0, 1000), "time that the lid stays shut in a blink"] = 35.0
    open_ms: Annotated[float, Bounds(50, 1500), "duration of opening in a blink"] = 175.0
    rest_opening: Annotated[float, Bounds(0.1, 1), "opening of the upper lids with level gaze, 0 shut to 1 open"] = 0.75
    law: Annotated[Literal["people", "nakamoto", "none"],
        "people: no two blinks are equal, large gaze shifts evoke some, and the lids follow the gaze; nakamoto: equal blinks at random, "
        "and one with every shift beyond 20 deg (3.6); none: gaze has no effect on the lids"] = "people"
    # fmt: on


@dataclass(frozen=True)
class LidLaw:
    """Constants of the lids; the defaults are people's.

    conversation_ratio: blinks in conversation for each at rest
    interval_cv: standard deviation over mean of log-normal intervals; None: exponential ones
    incomplete_share: share of blinks that do not shut the lid
    duration_sd: standard deviation of the logarithm of a blink's closing, shut and opening time
    evoked_beyond_deg: size of the gaze shifts that all evoke a blink; None: by chance
    evoked_sd_s: standard deviation of the time from the onset of a shift to that of its blink
    evoked_replaces: a gaze-evoked blink replaces the next spontaneous one
    follow_per_deg: decrease of the upper lids' opening per degree that the gaze goes down; the
        inverse of the lid's travel in degrees makes it follow the eye exactly
    lower_follow_per_deg: decrease of the lower lids' opening per degree that the gaze goes up
    """

    conversation_ratio: float = 26.0 / 17.0
    interval_cv: float | None = 0.8
    incomplete_share: float = 0.5
    duration_sd: float = 0.2
    evoked_beyond_deg: float | None = None
    evoked_sd_s: float = 0.03
    evoked_replaces: bool = True
    follow_per_deg: float = 0.0222
    lower_follow_per_deg: float = 0.008


PEOPLE = LidLaw()
NONE = LidLaw(
    conversation_ratio=1.0, evoked_beyond_deg=inf, follow_per_deg=0.0, lower_follow_per_deg=0.0
)
NAKAMOTO = LidLaw(
    conversation_ratio=1.0,
    interval_cv=None,
    incomplete_share=0.0,
    duration_sd=0.0,
    evoked_beyond_deg=20.0,
    evoked_sd_s=0.0,
    evoked_replaces=False,
    follow_per_deg=0.0,
    lower_follow_per_deg=0.0,
)
LAWS = {"people": PEOPLE, "nakamoto": NAKAMOTO, "none": NONE}

SHORTEST_PAUSE_S = 1.0
"""Shortest pause between a blink and the next spontaneous one."""
EVOKED_BEYOND_DEG = 6.0
"""Size of a gaze shift up to which it evokes no blink."""
_MIDDLE_DEG, _STEEPNESS_1_DEG = 17.0, 0.217
"""Size of a gaze shift that evokes a blink in half of the cases, and steepness of that chance."""
_LEAST_DEPTH, _NEARLY_SHUT = 0.6, 0.95
"""Depths of incomplete blinks."""


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

    onset_s: its start; close_s, hold_s, open_s: its durations
    depth: relative stroke of the lids, 1 is shut
    """

    onset_s: float
    close_s: float
    hold_s: float
    open_s: float
    depth: float = 1.0

    @property
    def length_s(self) -> float:
        """Return the total duration."""
        return self.close_s + self.hold_s + self.open_s

    def is_in_progress(self, t_s: float) -> bool:
        """Return whether it is in progress."""
        return self.onset_s <= t_s < self.onset_s + self.length_s

    def closure_at(self, t_s: float) -> float:
        """Return the closure of the lids, 0..1."""
        return self.depth * closure(t_s - self.onset_s, self.close_s, self.hold_s, self.open_s)

    def vary_durations(self, law: LidLaw, rng: np.random.Generator) -> "LidClosure":
        """Return it with randomly varied durations."""
        if law.duration_sd == 0.0:
            return self
        close, hold, open = np.exp(law.duration_sd * rng.standard_normal(3)).tolist()
        return self._replace(
            close_s=close * self.close_s, hold_s=hold * self.hold_s, open_s=open * self.open_s
        )


def blink_pause_s(law: LidLaw, per_min: float, length_s: float, rng: np.random.Generator) -> float:
    """Draw the pause from the end of a blink until the next spontaneous one.

    per_min: wanted rate of blinks, 1/min, 0 means never; length_s: duration of a blink
    """
    if per_min == 0.0:
        return inf
    between = 60.0 / per_min - length_s
    mean = max(between - SHORTEST_PAUSE_S, 0.05)
    if law.interval_cv is None:
        return SHORTEST_PAUSE_S + mean * float(rng.standard_exponential())
    # A log-normal part on top of the shortest pause, with mean and spread such that the whole pause
    # has the wanted ones.
    return SHORTEST_PAUSE_S + draw_lognormal(rng, mean, law.interval_cv * between / mean)


def evokes_blink(law: LidLaw, shift_deg: float, rng: np.random.Generator) -> bool:
    """Return whether a gaze shift evokes a blink (Evinger 1994).

    The logistic curve through the published points would evoke a blink in one of twenty shifts of 3
    deg; it is lowered such that it begins at ``EVOKED_BEYOND_DEG``, and 1 stays 1.
    """
    if law.evoked_beyond_deg is not None:
        return shift_deg > law.evoked_beyond_deg
    if shift_deg <= EVOKED_BEYOND_DEG:
        return False
    least = _logistic(EVOKED_BEYOND_DEG)
    return float(rng.random()) < (_logistic(shift_deg) - least) / (1.0 - least)


def _logistic(shift_deg: float) -> float:
    return 1.0 / (1.0 + exp(-_STEEPNESS_1_DEG * (shift_deg - _MIDDLE_DEG)))


def evoked_offset_s(law: LidLaw, rng: np.random.Generator) -> float:
    """Draw the time from the onset of a gaze shift to that of its blink, negative before it.

    The two typically begin together (Evinger 1994), the muscle of the lids some tens of ms sooner
    or later than eyes and head: a normal distribution, cut off at twice its deviation.
    """
    if law.evoked_sd_s == 0.0:
        return 0.0
    return law.evoked_sd_s * min(2.0, max(-2.0, float(rng.standard_normal())))


def blink_depth(law: LidLaw, rng: np.random.Generator) -> float:
    """Draw the depth of a blink, 1 is complete; most incomplete blinks are nearly complete."""
    if rng.random() >= law.incomplete_share:
        return 1.0
    return _LEAST_DEPTH + (_NEARLY_SHUT - _LEAST_DEPTH) * sqrt(float(rng.random()))

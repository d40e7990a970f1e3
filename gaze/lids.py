"""Lids: spontaneous and gaze-evoked blinks, winks, sleepiness, lids that follow the gaze.

Rates are those of Bentivoglio 1997: 17 a minute at rest, 26 in conversation, with
log-normal intervals. Closing is about twice as fast as opening (VanderWerf 2003; Kwon
2013). Large gaze shifts bring a blink with them (Evinger 1994: 97 % of those beyond
33 deg), once for each shift. Nakamoto & Tsuruno 3.6 print that rule as a level, eye and
head more than 20 deg apart, which would blink for ever with the head held aside; here
it is the event that the text before it describes. Opening 0 is shut, 1 is fully open.
"""

from dataclasses import dataclass, field
from math import degrees, exp, inf, log, sqrt
from typing import Literal, NamedTuple

import numpy as np

from gaze.saccade import min_jerk

Side = Literal["left", "right"]
LidMode = Literal["rest", "conversation"]

_DROOP_S = 1.0  # time in which lids sink or rise when the sleepiness changes
_GLIDE_S = 0.3  # and when what they do at rest is retuned


@dataclass(frozen=True)
class LidParams:
    """Rates and shapes."""

    blinks_per_min: float = field(
        default=17.0,
        metadata={
            "low": 0.0,
            "high": 60.0,
            "unit": "1/min",
            "says": "spontaneous blinks at rest; 0 is never",
        },
    )
    conversation_per_min: float = field(
        default=26.0,
        metadata={
            "low": 0.0,
            "high": 60.0,
            "unit": "1/min",
            "says": "spontaneous blinks in conversation; 0 is never",
        },
    )
    interval_law: str = field(
        default="lognormal",
        metadata={
            "choices": ("lognormal", "exponential", "fixed"),
            "unit": "",
            "says": "law of the intervals; all three keep the mean, fixed has no spread",
        },
    )
    interval_cv: float = field(
        default=0.8,
        metadata={
            "low": 0.05,
            "high": 3.0,
            "unit": "",
            "says": "spread of log-normal intervals: standard deviation over mean",
        },
    )
    shortest_interval_ms: float = field(
        default=1000.0,
        metadata={
            "low": 400.0,
            "high": 10000.0,
            "unit": "ms",
            "says": "pause after a blink before a spontaneous one",
        },
    )
    double_share: float = field(
        default=0.0,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "share of blinks with a second one right after them",
        },
    )
    double_gap_ms: float = field(
        default=100.0,
        metadata={"low": 0.0, "high": 500.0, "unit": "ms", "says": "pause between those two"},
    )
    incomplete_share: float = field(
        default=0.12,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "share of blinks that shut the lid by 0.70 to 0.85 only",
        },
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
    wink_hold_ms: float = field(
        default=200.0,
        metadata={"low": 0.0, "high": 3000.0, "unit": "ms", "says": "time shut in a wink"},
    )
    rest_opening: float = field(
        default=0.75,
        metadata={"low": 0.1, "high": 1.0, "unit": "", "says": "opening with level gaze"},
    )
    follow_per_deg: float = field(
        default=0.0222,
        metadata={
            "low": 0.0,
            "high": 0.1,
            "unit": "1/deg",
            "says": "change of the opening as the gaze sinks; gain 1 is one over the lid's travel",
        },
    )
    follow_up_share: float = field(
        default=0.85,
        metadata={
            "low": 0.0,
            "high": 1.5,
            "unit": "",
            "says": "the same above level gaze, in parts of the change below it",
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
    evoked_pause_ms: float = field(
        default=600.0,
        metadata={
            "low": 0.0,
            "high": 10000.0,
            "unit": "ms",
            "says": "from the onset of a blink to the next that a gaze shift may bring",
        },
    )
    evoked_literal: bool = field(
        default=False,
        metadata={
            "unit": "",
            "says": "a blink with every shift beyond evoked_literal_deg instead of the dice",
        },
    )
    evoked_literal_deg: float = field(
        default=20.0,
        metadata={
            "low": 0.0,
            "high": 180.0,
            "unit": "deg",
            "says": "a large saccade of Nakamoto & Tsuruno 3.6",
        },
    )
    sleepy_level: float = field(
        default=0.0,
        metadata={"low": 0.0, "high": 1.0, "unit": "", "says": "sleepiness at the start"},
    )
    sleepy_droop: float = field(
        default=0.65,
        metadata={
            "low": 0.0,
            "high": 1.0,
            "unit": "",
            "says": "part of the opening that full sleepiness takes away",
        },
    )
    sleepy_slowness: float = field(
        default=2.0,
        metadata={
            "low": 0.0,
            "high": 5.0,
            "unit": "",
            "says": "full sleepiness makes a blink this many times its length longer",
        },
    )


class _Shape(NamedTuple):
    """Times of a blink or wink; one under way keeps those that it began with."""

    close_s: float
    hold_s: float
    open_s: float
    wink_hold_s: float

    @property
    def blink_s(self) -> float:
        """Give the length of a blink of somebody awake."""
        return self.close_s + self.hold_s + self.open_s

    @property
    def wink_s(self) -> float:
        """Give the length of a wink."""
        return self.close_s + self.wink_hold_s + self.open_s


class Lids:
    """Opening of both lids as a function of time, with its own dice."""

    def __init__(self, params: LidParams, rng: np.random.Generator) -> None:
        """Take rates, shapes and dice."""
        self._params = params
        self._shape = _shape(params)
        self._rng = rng
        self._mode: LidMode = "rest"
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Open the lids and draw the first blink; the mode stays."""
        self.blinks = 0
        self._t_s = t_s
        self._onset_s = -inf
        self._depth = self._slow = 1.0
        self._redraw = False
        self._winks_s: dict[Side, float] = {"left": -inf, "right": -inf}
        level = self._params.sleepy_level
        self._droop_from, self._droop_to, self._droop_since_s = level, level, t_s
        self._shape = self._wanted_shape = _shape(self._params)
        self._pitch_deg = self._shown = self._left = 0.0
        self._retuned_s = t_s
        self._next_s = t_s + self._interval_s()

    def retune(self, params: LidParams) -> None:
        """Take other rates and shapes; a blink under way ends as it began, lids glide.

        The pause under way becomes longer or shorter as the mean pause does.
        """
        before_per_min = self._per_min()
        before, self._params = self._params, params
        per_min = self._per_min()
        if per_min != before_per_min:
            if per_min and before_per_min:
                self._next_s = self._t_s + (self._next_s - self._t_s) * before_per_min / per_min
            else:
                self._redraw = True
        self._fit_shape()
        if params.sleepy_level != before.sleepy_level:
            self.sleepy(params.sleepy_level)
        self._left = self._shown - self._opening(self._t_s)
        self._retuned_s = self._t_s

    def mode(self, name: LidMode) -> None:
        """Blink as often as people do at "rest" or in "conversation", from the next step on.

        Raises:
            ValueError: there is no such mode.
        """
        if name not in ("rest", "conversation"):
            raise ValueError(f"no lid mode {name!r}; modes: rest, conversation")
        # The interval under way was drawn for the other rate, perhaps for "never".
        self._redraw = self._redraw or name != self._mode
        self._mode = name

    def wink(self, side: Side, t_s: float) -> None:
        """Shut and open one lid, from ``t_s`` or the last step on; a wink under way goes on.

        Raises:
            ValueError: there is no such side.
        """
        if side not in self._winks_s:
            raise ValueError(f"no lid {side!r}; sides: left, right")
        if not self._under_way(self._winks_s[side], self._t_s):
            self._winks_s[side] = max(t_s, self._t_s)

    def sleepy(self, level: float) -> None:
        """Let the lids sink and the blinks grow long: 0 awake .. 1 hardly awake.

        Raises:
            ValueError: level is not within 0..1.
        """
        if not 0.0 <= level <= 1.0:
            raise ValueError(f"sleepy level {level} is not within 0..1")
        self._droop_from = self._sleepiness(self._t_s)
        self._droop_to, self._droop_since_s = level, self._t_s

    def step(
        self, t_s: float, eye_pitch_rad: float, shift_rad: float | None
    ) -> tuple[float, float, bool]:
        """Give the opening of the left and right lid and whether a blink is under way.

        shift_rad: size of a gaze shift that begins in this very tick, else None
        """
        self._t_s = t_s
        if self._shape != self._wanted_shape:
            self._fit_shape()
        if self._redraw:
            self._redraw, self._next_s = False, t_s + self._interval_s()
        if self._due(t_s, shift_rad):
            self._blink(t_s)
        blink = self._depth * self.closure((t_s - self._onset_s) / self._slow)
        left, right = (max(blink, self._winked(t_s - at_s)) for at_s in self._winks_s.values())
        self._pitch_deg = degrees(eye_pitch_rad)
        opening = self._shown = self._glided(self._opening(t_s), t_s)
        return opening * (1.0 - left), opening * (1.0 - right), blink > 0.0

    def closure(self, since_onset_s: float, hold_s: float | None = None) -> float:
        """Give how far a full blink has shut the lid, 0..1, a time after its onset.

        hold_s: time shut, of a blink where not given
        """
        close, hold, opening, _ = self._shape
        hold = hold if hold_s is None else hold_s
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

    def _opening(self, t_s: float) -> float:
        """Give the opening that goes with gaze and sleepiness, without blinks."""
        opening = self._level_opening(self._pitch_deg)
        return opening * (1.0 - self._params.sleepy_droop * self._sleepiness(t_s))

    def _glided(self, opening: float, t_s: float) -> float:
        """Add what a retune has left over, which goes within a moment."""
        if self._left == 0.0:
            return opening
        kept = 1.0 - min_jerk((t_s - self._retuned_s) / _GLIDE_S)
        if kept == 0.0:
            self._left = 0.0
        return min(1.0, max(0.0, opening + kept * self._left))

    def _fit_shape(self) -> None:
        """Take the shape that is wanted, unless a blink or wink is under way."""
        self._wanted_shape = _shape(self._params)
        at_s = self._t_s
        blinking = at_s - self._onset_s < self._length_s()
        if not blinking and not any(self._under_way(w, at_s) for w in self._winks_s.values()):
            self._shape = self._wanted_shape

    def _level_opening(self, eye_pitch_deg: float) -> float:
        """Give the opening that goes with a vertical gaze (Becker & Fuchs 1988)."""
        par = self._params
        share = par.follow_up_share if eye_pitch_deg > 0.0 else 1.0
        opening = par.rest_opening + par.follow_per_deg * share * eye_pitch_deg
        return min(1.0, max(0.0, opening))

    def _due(self, t_s: float, shift_rad: float | None) -> bool:
        """Tell whether a blink begins now; the dice of a shift are thrown once."""
        evoked = shift_rad is not None and self._evokes(degrees(abs(shift_rad)))
        if any(self._under_way(at_s, t_s) for at_s in self._winks_s.values()):
            # Both lids would shut, and the wink be lost in it.
            self._next_s = max(self._next_s, t_s + self._params.shortest_interval_ms / 1e3)
            return False
        since_s = t_s - self._onset_s
        if evoked and since_s >= max(self._params.evoked_pause_ms / 1e3, self._length_s()):
            return True
        return t_s >= self._next_s

    def _evokes(self, shift_deg: float) -> bool:
        """Tell whether a gaze shift brings a blink with it."""
        par = self._params
        if par.evoked_literal:
            return shift_deg > par.evoked_literal_deg
        beyond = shift_deg - par.evoked_middle_deg
        chance = 1.0 / (1.0 + exp(-par.evoked_steepness_1_deg * beyond))
        return float(self._rng.random()) < chance

    def _blink(self, t_s: float) -> None:
        """Begin a blink, draw how deep it is and when the next one comes."""
        par = self._params
        self.blinks += 1
        self._onset_s = t_s
        self._slow = 1.0 + par.sleepy_slowness * self._sleepiness(t_s)
        shallow = self._rng.random() < par.incomplete_share
        self._depth = float(self._rng.uniform(0.70, 0.85)) if shallow else 1.0
        double = self._rng.random() < par.double_share
        pause_s = par.double_gap_ms / 1e3 if double else self._interval_s()
        self._next_s = t_s + self._length_s() + pause_s

    def _winked(self, since_onset_s: float) -> float:
        return self.closure(since_onset_s, self._shape.wink_hold_s)

    def _under_way(self, wink_s: float, t_s: float) -> bool:
        """Tell whether the wink that began at ``wink_s`` is not over."""
        return wink_s <= t_s < wink_s + self._shape.wink_s

    def _sleepiness(self, t_s: float) -> float:
        way = min_jerk((t_s - self._droop_since_s) / _DROOP_S)
        return self._droop_from + way * (self._droop_to - self._droop_from)

    def _length_s(self) -> float:
        """Give the length of the blink under way, of an awake one before the first."""
        return self._slow * self._shape.blink_s

    def _per_min(self) -> float:
        par = self._params
        return par.blinks_per_min if self._mode == "rest" else par.conversation_per_min

    def _interval_s(self) -> float:
        """Draw the pause from the end of a blink until the next spontaneous one."""
        par = self._params
        per_min = self._per_min()
        if per_min == 0.0:
            return inf
        shortest = par.shortest_interval_ms / 1e3
        between = 60.0 / per_min - self._length_s()
        mean = max(between - shortest, 0.05)
        if par.interval_law == "fixed":
            return shortest + mean
        if par.interval_law == "exponential":
            return shortest + mean * float(self._rng.standard_exponential())
        # A log-normal part on top of the shortest pause, with mean and spread such that
        # the whole pause has those asked for.
        sigma2 = log(1.0 + (par.interval_cv * between / mean) ** 2)
        return shortest + mean * exp(sqrt(sigma2) * self._rng.standard_normal() - 0.5 * sigma2)


def _shape(params: LidParams) -> _Shape:
    return _Shape(
        params.close_ms / 1e3,
        params.hold_ms / 1e3,
        params.open_ms / 1e3,
        params.wink_hold_ms / 1e3,
    )

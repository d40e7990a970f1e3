"""Lids: spontaneous and gaze-evoked blinks, winks, sleepiness, lids that follow the gaze.

Rates and their sources: gaze.lid_params. Nakamoto & Tsuruno 3.6 print the rule of gaze-evoked
blinks as a level, eye and head more than 20 deg apart, which would blink permanently while the head
is turned aside; here it is the event that the preceding text describes. Opening 0 is shut, with
upper and lower lid in contact; 1 is fully open. A blink moves both lids from their present openings
to 0, so they meet at any gaze direction.
"""

from math import degrees, inf, radians, tanh
from typing import Literal, NamedTuple

import numpy as np

from gazerig.gaze.lids.blink import (
    LidClosure,
    blink_depth,
    blink_pause_s,
    closure,
    evoked_offset_s,
    evokes_blink,
    is_double_blink,
)
from gazerig.gaze.lids.lid_params import LidParams as LidParams
from gazerig.gaze.lids.lid_rest import LidPair, LidsAtRest
from gazerig.gaze.types import Angles2

Side = Literal["left", "right"]
LidMode = Literal["rest", "conversation"]

_NOT_SHUT: LidPair = (0.0, 0.0)
_ROUNDING_S = 1e-6
_MOST_INTERVALS = 3.0
"""Largest delay of a spontaneous blink by gaze-evoked ones, in mean intervals."""


class LidOpenings(NamedTuple):
    """Openings of the lids, 0 shut .. 1 open, and whether a blink is in progress.

    left, right: upper lids; lower_left, lower_right: lower lids
    """

    left: float
    right: float
    blink: bool
    lower_left: float
    lower_right: float

    @property
    def openings(self) -> tuple[float, float, float, float]:
        """Return the openings in the order of the factors of ``scale``."""
        return self.left, self.right, self.lower_left, self.lower_right

    def replace(self, openings: tuple[float, float, float, float]) -> "LidOpenings":
        """Return other openings with the same blink."""
        left, right, lower_left, lower_right = openings
        return LidOpenings(left, right, self.blink, lower_left, lower_right)

    def scale(self, factors: tuple[float, float, float, float]) -> "LidOpenings":
        """Return the openings times factors, slowing down towards fully open.

        factors: factors of the left and right upper, then of the left and right lower lid
        """
        left, right, lower_left, lower_right = factors
        return LidOpenings(
            _scale_opening(self.left, left),
            _scale_opening(self.right, right),
            self.blink,
            _scale_opening(self.lower_left, lower_left),
            _scale_opening(self.lower_right, lower_right),
        )


def _scale_opening(opening: float, factor: float) -> float:
    """Return an opening times a factor, with a smooth limit at fully open.

    Beyond factor 1 it approaches 1 as tanh does, with the same slope and no bend at 1.
    """
    room = 1.0 - opening
    if factor <= 1.0 or room <= 0.0:
        return min(1.0, opening * factor)
    return opening + room * tanh(opening * (factor - 1.0) / room)


class Lids:
    """Openings of upper and lower lids as a function of time, with their own random generator."""

    def __init__(self, params: LidParams, rng: np.random.Generator) -> None:
        self._params = params
        self._rest = LidsAtRest(params)
        self._rng = rng
        self._mode: LidMode = "rest"
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Open the lids and draw the first blink; the mode stays."""
        self.blinks = 0
        self._t_s = t_s
        self._blink: LidClosure | None = None
        self._sides: tuple[LidClosure, LidClosure] | None = None
        self._winks: dict[Side, LidClosure | None] = {"left": None, "right": None}
        self._shut_until_s = -inf
        self._evoked_s = inf
        self._announced = False
        self._redraw = False
        self._rest.reset(t_s)
        self._next_s = t_s + self._pause_s(self._length_s())

    def retune(self, params: LidParams) -> None:
        """Change rates and shapes; a blink in progress ends unchanged, without a jump.

        The present pause is scaled like the mean pause.
        """
        before_per_min = self._per_min()
        self._params = params
        per_min = self._per_min()
        if per_min != before_per_min:
            if per_min and before_per_min:
                self._next_s = self._t_s + (self._next_s - self._t_s) * before_per_min / per_min
            else:
                self._redraw = True
        self._rest.retune(params, self._t_s)

    def set_mode(self, name: LidMode) -> None:
        """Set the blink rate to that at "rest" or in "conversation", from the next step on.

        Raises:
            ValueError: there is no such mode.
        """
        if name not in ("rest", "conversation"):
            raise ValueError(f"no lid mode {name!r}; modes: rest, conversation")
        # The present interval was drawn for the other rate, perhaps for "never".
        self._redraw = self._redraw or name != self._mode
        self._mode = name

    def wink(self, side: Side, t_s: float) -> None:
        """Shut and open the lids of one eye; a wink in progress continues.

        t_s: start, no earlier than the last step

        Raises:
            ValueError: there is no such side.
        """
        if side not in self._winks:
            raise ValueError(f"no lid {side!r}; sides: left, right")
        wink = self._winks[side]
        if wink is None or not wink.is_in_progress(self._t_s):
            wink = self._full_closure(max(t_s, self._t_s), self._params.wink_hold_ms)
            self._winks[side] = wink
            self._record_motion_end(wink)

    def set_sleepiness(self, level: float) -> None:
        """Set the sleepiness, which lowers the lids and slows blinks: 0 awake .. 1 hardly awake.

        Raises:
            ValueError: level is not within 0..1.
        """
        self._rest.set_sleepiness(level, self._t_s)

    def draw_blink_of_shift(self, shift_rad: float, onset_s: float, t_s: float) -> float:
        """Draw the blink of a gaze shift that is about to begin; return the delay of the shift.

        A blink that precedes its shift begins now at the earliest, and the shift after it.

        Args:
            shift_rad: size of the shift.
            onset_s: its planned start.
            t_s: present time, seconds.
        """
        par, blink = self._params, self._blink
        shift_deg = degrees(shift_rad)
        self._announced = shift_deg > par.gaze_evoked_blink_least_deg
        if not self._announced or not evokes_blink(par, shift_deg, self._rng):
            return 0.0
        if blink is not None and onset_s - blink.onset_s < self._pause_after_s():
            return 0.0
        blinks_s = onset_s + evoked_offset_s(par, self._rng)
        self._evoked_s = min(self._evoked_s, max(blinks_s, t_s))
        return max(0.0, t_s - blinks_s)

    def step(self, t_s: float, eye_pitch_rad: float, shift_rad: float | None) -> LidOpenings:
        """Return the openings of the lids and whether a blink is in progress.

        shift_rad: size of a gaze shift that begins in this tick, otherwise None; an announced one
            has its blink already
        """
        self._t_s = t_s
        if self._redraw:
            self._redraw, self._next_s = False, t_s + self._pause_s(self._length_s())
        upper, lower = self._rest.step(t_s, degrees(eye_pitch_rad))
        if shift_rad is None and self._shut_until_s < t_s < self._next_s and t_s < self._evoked_s:
            return tuple.__new__(LidOpenings, (upper, upper, False, lower, lower))
        if self._is_blink_due(t_s, shift_rad):
            self._begin_blink(t_s)
        blinks = [_closures(side, t_s) for side in self._sides or (None, None)]
        (left, lower_left), (right, lower_right) = (
            _larger_closure(blink, _closures(wink, t_s))
            for blink, wink in zip(blinks, self._winks.values(), strict=True)
        )
        # Just before their end, closures exceed 1 by a rounding error.
        return LidOpenings(
            upper * max(0.0, 1.0 - left),
            upper * max(0.0, 1.0 - right),
            blinks[0][0] > 0.0 or blinks[1][0] > 0.0,
            lower * max(0.0, 1.0 - lower_left),
            lower * max(0.0, 1.0 - lower_right),
        )

    def eye_turn_rad(self, t_s: float) -> tuple[Angles2, Angles2] | None:
        """Return the turns of left and right eye, (yaw, pitch), with a blink; None without any."""
        par, blink = self._params, self._blink
        share = 0.0 if blink is None else blink.eye_turn(t_s)
        if share == 0.0:
            return None
        nasal, down = radians(share * par.eye_nasal_deg), -radians(share * par.eye_down_deg)
        return (-nasal, down), (nasal, down)

    def closure(self, since_onset_s: float) -> float:
        """Return the closure of the upper lid by a full blink, 0..1, at a time after its onset."""
        _, close_s, hold_s, open_s, *_ = self._full_closure(0.0, self._params.hold_ms)
        return closure(since_onset_s, close_s, hold_s, open_s)

    def _is_blink_due(self, t_s: float, shift_rad: float | None) -> bool:
        """Return whether a blink begins now; each gaze shift has one draw."""
        par, blink = self._params, self._blink
        if shift_rad is not None:
            announced, self._announced = self._announced, False
            if not announced and evokes_blink(par, degrees(abs(shift_rad)), self._rng):
                after_s = abs(evoked_offset_s(par, self._rng))
                self._evoked_s = min(self._evoked_s, t_s + after_s)
        if any(wink is not None and wink.is_in_progress(t_s) for wink in self._winks.values()):
            # Both eyes would shut, and hide the wink.
            self._evoked_s = inf
            self._next_s = max(self._next_s, t_s + par.min_interval_ms / 1e3)
            return False
        if t_s >= self._evoked_s:
            since_s = inf if blink is None else t_s - blink.onset_s
            if since_s >= self._pause_after_s():
                return True
            self._evoked_s = inf
        # A higher rate may require the next blink before this one has ended.
        return t_s >= self._next_s and (blink is None or not blink.is_in_progress(t_s))

    def _begin_blink(self, t_s: float) -> None:
        """Start a blink; draw its depth and the time of the next one."""
        par = self._params
        self.blinks += 1
        slow = 1.0 + par.sleepy_slowness * self._rest.sleepiness(t_s)
        blink = self._full_closure(t_s, par.hold_ms)._replace(
            depth=blink_depth(par, self._rng), slowness=slow
        )
        self._blink = blink = blink.vary_durations(par, self._rng)
        self._sides = blink.left_and_right(par, self._rng)
        for side in self._sides:
            self._record_motion_end(side)
        double = is_double_blink(par, self._rng)
        pause_s = par.double_gap_ms / 1e3 if double else self._pause_s(blink.length_s)
        after_s, ends_s = blink.length_s + pause_s, t_s + blink.length_s
        if t_s >= self._evoked_s and par.gaze_evoked_blink_replaces and not double:
            # The next spontaneous blink is skipped, the one after it stays.
            most_s = ends_s + _MOST_INTERVALS * self._mean_s()
            soonest_s = ends_s + par.min_interval_ms / 1e3
            self._next_s = max(min(self._next_s + after_s, most_s), soonest_s)
        else:
            self._next_s = t_s + after_s
        self._evoked_s = inf

    def _record_motion_end(self, closing: LidClosure) -> None:
        """Record the end of the lids' motion, for a blink or wink that begins."""
        ends_s = closing.onset_s + closing.length_s + _ROUNDING_S
        self._shut_until_s = max(self._shut_until_s, ends_s)

    def _full_closure(self, onset_s: float, hold_ms: float) -> LidClosure:
        """Return a complete closure at no sleepiness."""
        par = self._params
        return LidClosure(
            onset_s, par.close_ms / 1e3, hold_ms / 1e3, par.open_ms / 1e3, par.lower_close_share
        )

    def _pause_after_s(self) -> float:
        """Return the shortest time from the onset of a blink to that of a gaze-evoked one."""
        return max(self._params.gaze_evoked_blink_pause_ms / 1e3, self._length_s())

    def _length_s(self) -> float:
        """Return the length of the last blink, of an awake one before the first."""
        if self._blink is not None:
            return self._blink.length_s
        return self._full_closure(0.0, self._params.hold_ms).length_s

    def _per_min(self) -> float:
        par = self._params
        return par.blinks_per_min if self._mode == "rest" else par.conversation_per_min

    def _mean_s(self) -> float:
        """Return the mean interval between blinks, inf without any."""
        per_min = self._per_min()
        return 60.0 / per_min if per_min else inf

    def _pause_s(self, length_s: float) -> float:
        return blink_pause_s(self._params, self._per_min(), length_s, self._rng)


def _closures(closing: LidClosure | None, t_s: float) -> LidPair:
    """Return the closure of the upper and the lower lid by a blink or wink, 0..1."""
    shut = 0.0 if closing is None else closing.closure_at(t_s)
    if closing is None or shut == 0.0:
        return _NOT_SHUT
    return shut, closing.lower_share * shut


def _larger_closure(one: LidPair, other: LidPair) -> LidPair:
    if other is _NOT_SHUT:
        return one
    return max(one[0], other[0]), max(one[1], other[1])

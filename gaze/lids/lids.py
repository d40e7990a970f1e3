"""Lids: spontaneous and gaze-evoked blinks, winks, lids that follow the gaze.

Eyes that turn down take both lids down. Upper lids follow the gaze with a gain of about 1 (Becker &
Fuchs 1988), lower lids in the same direction by a quarter of that (Leite 2006: 2.2 mm and 9.1 mm in
the same saccades of people of 20 to 30; a third at 60 and more), equally up and down. So the middle
of the fissure follows the eye, and the fissure narrows (Read 2006: from 9.7 to 6.4 mm at 40 deg
down).

Nakamoto & Tsuruno 3.6 print the rule of gaze-evoked blinks as a level, eye and head more than 20
deg apart, which would blink permanently while the head is turned aside; here it is the event that
the preceding text describes. Opening 0 is shut, with upper and lower lid in contact; 1 is fully
open. A blink moves both lids from their present openings to 0, so they meet at any gaze direction.
"""

from collections.abc import Sequence
from math import degrees, inf, tanh
from operator import add
from typing import Literal, NamedTuple

import numpy as np

from gazerig.gaze.lids.blink import (
    EVOKED_BEYOND_DEG,
    LAWS,
    SHORTEST_PAUSE_S,
    LidClosure,
    LidParams,
    blink_depth,
    blink_pause_s,
    evoked_offset_s,
    evokes_blink,
)
from gazerig.gaze.minimum_jerk import MinimumJerkBlend

Side = Literal["left", "right"]

_ROUNDING_S = 1e-6
_MOST_INTERVALS = 3.0
"""Largest delay of a spontaneous blink by gaze-evoked ones, in mean intervals."""
_EVOKED_PAUSE_S = 0.6, 1.5
"""Shortest time from the onset of a blink to one evoked by a gaze shift; from an evoked one: also a
head that looks to and fro blinks at the published rate.
"""
_WINK_HOLD_MS = 200.0
_UP_SHARE = 0.85
"""Factor on the upper lids' following above level gaze."""
_LOWER_REST = 0.8
"""Opening of the lower lids with level gaze."""
_GLIDE_S = 0.3
"""Duration of a change of the rest positions."""


class LidOpenings(NamedTuple):
    """Openings of the lids, 0 shut .. 1 open, and whether a blink is in progress.

    left, right: upper lids; lower_left, lower_right: lower lids
    """

    left: float
    right: float
    blink: bool
    lower_left: float
    lower_right: float

    def change(self, factors: Sequence[float], added: Sequence[float]) -> "LidOpenings":
        """Return the openings times factors, slowing down towards fully open, and plus others.

        Args:
            factors: Those of the left and right upper, then of the left and right lower lid.
            added: What is added to the products, in the same order.
        """
        openings = self.left, self.right, self.lower_left, self.lower_right
        scaled = map(_scale_opening, openings, factors)
        left, right, low_left, low_right = map(_clip, map(add, scaled, added))
        return LidOpenings(left, right, self.blink, low_left, low_right)


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
        self._rng = rng
        self._converses = False
        self._set_params(params)
        self._rest = MinimumJerkBlend(self._rest_values(), _GLIDE_S)
        self.reset(0.0)

    def _set_params(self, params: LidParams) -> None:
        self._params, self._law = params, LAWS[params.law]

    def _rest_values(self) -> tuple[float, ...]:
        """Return the rest opening of the upper lids, and the following of upper and lower ones."""
        law = self._law
        return self._params.rest_opening, law.follow_per_deg, law.lower_follow_per_deg

    def reset(self, t_s: float) -> None:
        """Open the lids and draw the first blink; conversation stays."""
        self.blinks = 0
        self._blink: LidClosure | None = None
        self._winks: dict[Side, LidClosure | None] = {"left": None, "right": None}
        self._t_s, self._shut_until_s = t_s, -inf
        self._evoked_s, self._evoked_pause_s = inf, 0.0
        self._announced = False
        self._redraw = False
        self._rest.reset(self._rest_values())
        self._next_s = t_s + self._pause_s(self._length_s())

    def retune(self, params: LidParams) -> None:
        """Change law, rate and shape; a blink in progress ends unchanged, without a jump."""
        before_per_min = self._per_min()
        self._set_params(params)
        self._redraw = self._redraw or self._per_min() != before_per_min
        self._rest.move_to(self._rest_values())

    def set_conversation(self, converses: bool) -> None:
        """Blink as often as in conversation, or as at rest, from the next step on."""
        # The present interval was drawn for the other rate.
        self._redraw = self._redraw or converses != self._converses
        self._converses = converses

    def wink(self, side: Side, t_s: float) -> None:
        """Shut and open the lids of one eye; a wink in progress continues.

        t_s: start, no earlier than the last step
        """
        wink = self._winks[side]
        if wink is None or not wink.is_in_progress(self._t_s):
            wink = self._full_closure(max(t_s, self._t_s), _WINK_HOLD_MS)
            self._winks[side] = wink
            self._record_motion_end(wink)

    def draw_blink_of_shift(self, shift_rad: float, onset_s: float, t_s: float) -> float:
        """Draw the blink of a gaze shift that is about to begin; return the delay of the shift.

        A blink that precedes its shift begins now at the earliest, and the shift after it.

        Args:
            shift_rad: size of the shift.
            onset_s: its planned start.
            t_s: present time, seconds.
        """
        blink, shift_deg = self._blink, degrees(shift_rad)
        self._announced = shift_deg > EVOKED_BEYOND_DEG
        if not self._announced or not evokes_blink(self._law, shift_deg, self._rng):
            return 0.0
        if blink is not None and onset_s - blink.onset_s < self._evoked_pause_s:
            return 0.0
        blinks_s = onset_s + evoked_offset_s(self._law, self._rng)
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
        up_deg = degrees(eye_pitch_rad)
        rest, follow, lower_follow = self._rest.step(t_s)
        upper = _clip(rest + follow * (_UP_SHARE if up_deg > 0.0 else 1.0) * up_deg)
        lower = _clip(_LOWER_REST - lower_follow * up_deg)
        if shift_rad is None and self._shut_until_s < t_s < self._next_s and t_s < self._evoked_s:
            return tuple.__new__(LidOpenings, (upper, upper, False, lower, lower))
        if self._is_blink_due(t_s, shift_rad):
            self._begin_blink(t_s)
        blink = _closure(self._blink, t_s)
        # Just before their end, closures exceed 1 by a rounding error.
        left, right = (
            max(0.0, 1.0 - max(blink, _closure(wink, t_s))) for wink in self._winks.values()
        )
        return LidOpenings(upper * left, upper * right, blink > 0.0, lower * left, lower * right)

    def _is_blink_due(self, t_s: float, shift_rad: float | None) -> bool:
        """Return whether a blink begins now; each gaze shift has one draw."""
        blink = self._blink
        if shift_rad is not None:
            announced, self._announced = self._announced, False
            if not announced and evokes_blink(self._law, degrees(abs(shift_rad)), self._rng):
                after_s = abs(evoked_offset_s(self._law, self._rng))
                self._evoked_s = min(self._evoked_s, t_s + after_s)
        if any(wink is not None and wink.is_in_progress(t_s) for wink in self._winks.values()):
            # Both eyes would shut, and hide the wink.
            self._evoked_s = inf
            self._next_s = max(self._next_s, t_s + SHORTEST_PAUSE_S)
            return False
        if t_s >= self._evoked_s:
            if blink is None or t_s - blink.onset_s >= self._evoked_pause_s:
                return True
            self._evoked_s = inf
        # A higher rate may require the next blink before this one has ended.
        return t_s >= self._next_s and (blink is None or not blink.is_in_progress(t_s))

    def _begin_blink(self, t_s: float) -> None:
        """Start a blink; draw its depth and the time of the next one."""
        self.blinks += 1
        blink = self._full_closure(t_s, self._params.hold_ms)
        blink = blink._replace(depth=blink_depth(self._law, self._rng))
        self._blink = blink = blink.vary_durations(self._law, self._rng)
        self._record_motion_end(blink)
        after_s, ends_s = blink.length_s + self._pause_s(blink.length_s), t_s + blink.length_s
        replaces = t_s >= self._evoked_s and self._law.evoked_replaces
        self._evoked_pause_s = max(_EVOKED_PAUSE_S[replaces], blink.length_s)
        if replaces:
            # The next spontaneous blink is skipped, the one after it stays.
            most_s = ends_s + _MOST_INTERVALS * self._mean_s()
            soonest_s = ends_s + SHORTEST_PAUSE_S
            self._next_s = max(min(self._next_s + after_s, most_s), soonest_s)
        else:
            self._next_s = t_s + after_s
        self._evoked_s = inf

    def _record_motion_end(self, closing: LidClosure) -> None:
        """Record the end of the lids' motion, for a blink or wink that begins."""
        ends_s = closing.onset_s + closing.length_s + _ROUNDING_S
        self._shut_until_s = max(self._shut_until_s, ends_s)

    def _full_closure(self, onset_s: float, hold_ms: float) -> LidClosure:
        par = self._params
        return LidClosure(onset_s, par.close_ms / 1e3, hold_ms / 1e3, par.open_ms / 1e3)

    def _length_s(self) -> float:
        """Return the length of the last blink, of a full one before the first."""
        blink = self._blink or self._full_closure(0.0, self._params.hold_ms)
        return blink.length_s

    def _per_min(self) -> float:
        ratio = self._law.conversation_ratio if self._converses else 1.0
        return self._params.blinks_per_min * ratio

    def _mean_s(self) -> float:
        """Return the mean interval between blinks, inf without any."""
        per_min = self._per_min()
        return 60.0 / per_min if per_min else inf

    def _pause_s(self, length_s: float) -> float:
        return blink_pause_s(self._law, self._per_min(), length_s, self._rng)


def _clip(opening: float) -> float:
    return opening if 0.0 < opening < 1.0 else 1.0 if opening >= 1.0 else 0.0


def _closure(closing: LidClosure | None, t_s: float) -> float:
    return 0.0 if closing is None else closing.closure_at(t_s)

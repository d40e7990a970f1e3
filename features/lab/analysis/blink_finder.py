"""Openings of a rig's lids, and the blinks of a run.

A blink closes both lids by half or more and opens them again; lids that follow the gaze down stay
down. Closing and opening last while the lid is faster than a twentieth of the phase's peak speed,
as blink kinematics are usually measured (VanderWerf et al. 2003).

Upper lids move up and down with the eyes. A gaze shift with a blink also moves the lids to another
opening. So a blink found in the opening itself would begin with the shift rather than at its own
onset, or never end because the lid does not return to its old opening. The share of the opening of
lids at rest with the same gaze has neither fault.
"""

from collections.abc import Iterator, Sequence
from math import inf, nan
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats

_DEEP_SHARE, _BACK_SHARE = 0.5, 0.75
"""Fractions of the opening before: a blink starts below the first and is over above the second."""

_LONGEST_S = 2.0
_BEFORE_S = 0.4
_AFTER_S = 0.12
_FOOT_SHARE = 0.05
_OPEN_S = 0.5
"""Time constant with which the opening before a blink is learned."""

_LEAST_OPEN = 0.15
"""Lids with a smaller opening than this do not show a blink."""

_BIN_DEG = 2.0
_LEAST_SHARE = 0.002
"""Least share of samples near a gaze for an estimate of the lids' opening at rest."""

_GAP_S = 0.1


class BlinkEvent(NamedTuple):
    """One blink of both lids.

    onset_s: start of the closing; close_s, hold_s, open_s: durations of its phases
    depth: fraction of the opening by which the lids closed; 1 is shut
    close_peak_1_s, open_peak_1_s: peak speeds of closing and opening, full lid travels per second
    """

    onset_s: float
    close_s: float
    hold_s: float
    open_s: float
    depth: float
    close_peak_1_s: float
    open_peak_1_s: float


UPPER = ("left_upper_lid", "right_upper_lid")


def wider_opening(left: float, right: float, names: Sequence[str]) -> float:
    """Return the wider opening of two lids, because a wink is not a blink; NaN without lids.

    names: joints of the rig; empty: all joints
    """
    openings = zip(UPPER, (left, right), strict=True)
    return max((opening for name, opening in openings if not names or name in names), default=nan)


def resting_opening(opening: Floats, pitch_deg: Floats) -> Floats:
    """Return (n,) the opening of the lids without blinks, estimated from the run.

    Args:
        opening: (n,) of the upper lids, 0 shut .. 1 open.
        pitch_deg: (n,) of the eyes in the head, + up.
    """
    bins = np.floor(pitch_deg / _BIN_DEG)
    kinds, counts = np.unique(bins, return_counts=True)
    often = [bins == kind for kind in kinds[counts >= _LEAST_SHARE * len(opening)]]
    # Lids are shut for less than half of the time, whatever the gaze.
    rest = [float(np.median(opening[rows])) for rows in often]
    middle = [float(np.median(pitch_deg[rows])) for rows in often]
    return np.asarray(np.interp(pitch_deg, middle, rest))


def blinks_of(t_s: Floats, opening: Floats, pitch_deg: Floats) -> tuple[BlinkEvent, ...]:
    """Return the blinks of a run; depths and speeds are shares of the opening at rest.

    Args:
        t_s: (n,) times.
        opening: (n,) the wider one of both upper lids, 0 shut .. 1 open; nan without lids.
        pitch_deg: (n,) of the eyes in the head, + up.
    """
    known = np.isfinite(opening) & np.isfinite(pitch_deg)
    if not known.any():
        return ()
    t_s, opening, pitch_deg = t_s[known], opening[known], pitch_deg[known]
    share = opening / np.maximum(resting_opening(opening, pitch_deg), _LEAST_OPEN)
    cuts = np.flatnonzero(np.diff(t_s) > _GAP_S) + 1
    stretches = zip(np.split(t_s, cuts), np.split(share, cuts), strict=True)
    return tuple(blink for stretch in stretches for blink in find_blinks(*stretch))


def find_blinks(t_s: Floats, opening: Floats) -> Iterator[BlinkEvent]:
    """Yield the blinks in a stretch without gaps, from times and openings, (n,) each."""
    usual, shut_s, back_s = float(opening[0]), inf, inf
    before_s = float(t_s[0])
    for row, (now_s, now) in enumerate(zip(t_s.tolist(), opening.tolist(), strict=True)):
        if shut_s == inf:  # quickly up and slowly down
            share = (4.0 if now > usual else 1.0) * (now_s - before_s) / _OPEN_S
            usual += (now - usual) * min(1.0, share)
            if now < _DEEP_SHARE * usual and usual > _LEAST_OPEN:
                shut_s = now_s
        else:
            if back_s == inf and now >= _BACK_SHARE * usual:
                back_s = now_s
            if now_s - back_s >= _AFTER_S:
                part = slice(int(np.searchsorted(t_s, shut_s - _BEFORE_S)), row + 1)
                yield from _measure_blink(t_s[part], opening[part], usual)
                shut_s = back_s = inf
            elif now_s - shut_s > _LONGEST_S:  # asleep, or looking down: this is the new opening
                usual, shut_s, back_s = now, inf, inf
        before_s = now_s


def _measure_blink(t_s: Floats, opening: Floats, usual: float) -> Iterator[BlinkEvent]:
    """Yield the blink in a stretch from before it until after it, if it has both phases."""
    lowest = int(opening.argmin())
    if not 1 < lowest < len(opening) - 2:
        return
    speed, t_s = (opening[2:] - opening[:-2]) / (t_s[2:] - t_s[:-2]), t_s[1:-1]
    down, up = int(speed[:lowest].argmin()), lowest - 1 + int(speed[lowest - 1 :].argmax())
    if speed[down] >= 0.0 or speed[up] <= 0.0:
        return
    close_from, close_to = _phase_times_s(t_s, -speed, down)
    open_from, open_to = _phase_times_s(t_s, speed, up)
    yield BlinkEvent(
        close_from,
        close_to - close_from,
        max(0.0, open_from - close_to),
        open_to - max(open_from, close_to),
        float(1.0 - opening[lowest] / usual),
        float(-speed[down]),
        float(speed[up]),
    )


def _phase_times_s(t_s: Floats, speed: Floats, peak: int) -> tuple[float, float]:
    """Return the times at which the speed crosses the threshold before and after its peak."""
    foot = _FOOT_SHARE * speed[peak]
    slow = np.flatnonzero(speed <= foot)
    first = max(slow[slow < peak], default=0)
    last = min(slow[slow > peak], default=len(speed) - 1)
    before, after = [first, first + 1], [last, last - 1]
    return (
        float(np.interp(foot, speed[before], t_s[before])),
        float(np.interp(foot, speed[after], t_s[after])),
    )

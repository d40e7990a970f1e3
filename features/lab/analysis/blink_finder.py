"""Openings of a rig's lids, and the blinks of a run.

A blink closes both lids by half or more and opens them again; lids that follow the gaze down stay
down. Closing and opening last while the lid is faster than a twentieth of the phase's peak speed,
as blink kinematics are usually measured (VanderWerf et al. 2003).

Upper lids move up and down with the eyes. A gaze shift with a blink also moves the lids to another
opening. So a blink found in the opening itself would begin with the shift rather than at its own
onset, or never end because the lid does not return to its old opening. The share of the opening of
lids at rest with the same gaze has neither fault.
"""

from collections import deque
from collections.abc import Sequence
from math import nan
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

    @property
    def duration_s(self) -> float:
        """Return the total duration."""
        return self.close_s + self.hold_s + self.open_s


class BlinkFinder:
    """Finds blinks in a sequence of lid openings; each is returned when it has ended."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Clear the trace, after a gap."""
        self._trace: deque[tuple[float, float]] = deque()
        self._usual = 0.0
        self._shut_s: float | None = None
        self._back_s: float | None = None

    def update(self, t_s: float, opening: float) -> BlinkEvent | None:
        """Add the wider opening, 0 shut .. 1 open; return the blink that has just ended, if any."""
        trace = self._trace
        if not trace:
            self._usual = opening
        elif self._shut_s is None:  # quickly up and slowly down
            speed = 4.0 if opening > self._usual else 1.0
            share = min(1.0, speed * (t_s - trace[-1][0]) / _OPEN_S)
            self._usual += (opening - self._usual) * share
        trace.append((t_s, opening))
        if self._shut_s is None:
            while trace[0][0] < t_s - _BEFORE_S:
                trace.popleft()
            if opening < _DEEP_SHARE * self._usual and self._usual > _LEAST_OPEN:
                self._shut_s = t_s
            return None
        return self._await_opening(t_s, opening, self._shut_s)

    def _await_opening(self, t_s: float, opening: float, shut_s: float) -> BlinkEvent | None:
        """Wait until the lids are open again, and a little longer."""
        if self._back_s is None and opening >= _BACK_SHARE * self._usual:
            self._back_s = t_s
        if self._back_s is not None and t_s - self._back_s >= _AFTER_S:
            self._shut_s = self._back_s = None
            return _measure_blink(list(self._trace), self._usual)
        if t_s - shut_s > _LONGEST_S:  # asleep, or looking down: this is the new opening
            self._shut_s = self._back_s = None
            self._usual = opening
        return None


def _measure_blink(trace: list[tuple[float, float]], usual: float) -> BlinkEvent | None:
    """Measure one blink: (time, opening) rows from before it until after it."""
    t = [row[0] for row in trace]
    o = [row[1] for row in trace]
    lowest = min(range(len(o)), key=o.__getitem__)
    speed = [
        (o[i + 1] - o[i - 1]) / (t[i + 1] - t[i - 1]) for i in range(1, len(o) - 1)
    ]  # speed of row i + 1
    if not 1 < lowest < len(o) - 2:
        return None
    down = min(range(lowest), key=speed.__getitem__)
    up = max(range(lowest - 1, len(speed)), key=speed.__getitem__)
    if speed[down] >= 0.0 or speed[up] <= 0.0:
        return None
    close_from, close_to = _phase_times_s(t[1:-1], [-v for v in speed], down)
    open_from, open_to = _phase_times_s(t[1:-1], speed, up)
    return BlinkEvent(
        close_from,
        close_to - close_from,
        max(0.0, open_from - close_to),
        open_to - max(open_from, close_to),
        1.0 - o[lowest] / usual,
        -speed[down],
        speed[up],
    )


def _phase_times_s(t: list[float], speed: list[float], peak: int) -> tuple[float, float]:
    """Return the times at which the speed crosses the threshold before and after its peak."""
    foot = _FOOT_SHARE * speed[peak]
    first = last = peak
    while first > 0 and speed[first] > foot:
        first -= 1
    while last < len(speed) - 1 and speed[last] > foot:
        last += 1
    return (
        _interpolate_time(t[first], t[first + 1], speed[first], speed[first + 1], foot),
        _interpolate_time(t[last], t[last - 1], speed[last], speed[last - 1], foot),
    )


def _interpolate_time(t_low: float, t_high: float, low: float, high: float, level: float) -> float:
    share = (level - low) / (high - low) if high > low else 0.0
    return t_low + min(1.0, max(0.0, share)) * (t_high - t_low)


UPPER = ("left_upper_lid", "right_upper_lid")
LOWER = ("left_lower_lid", "right_lower_lid")


def wider_opening(left: float, right: float, names: Sequence[str], pair: tuple[str, str]) -> float:
    """Return the wider opening of two lids, because a wink is not a blink; NaN without lids.

    pair: joints of the left and the right lid; names: joints of the rig; empty: all joints
    """
    openings = zip(pair, (left, right), strict=True)
    return max((opening for name, opening in openings if not names or name in names), default=nan)


def resting_opening(opening: Floats, pitch_deg: Floats) -> Floats:
    """Return (n,) the opening of the lids without blinks, estimated from the run.

    Args:
        opening: (n,) of the upper lids, 0 shut .. 1 open.
        pitch_deg: (n,) of the eyes in the head, + up.
    """
    bins = np.floor(pitch_deg / _BIN_DEG).astype(int)
    bins -= bins.min()
    counts = np.bincount(bins)
    often = np.flatnonzero(counts >= max(1.0, _LEAST_SHARE * len(opening)))
    order = np.argsort(bins, kind="stable")
    pieces = np.split(order, np.cumsum(counts)[:-1])
    # Lids are shut for less than half of the time, whatever the gaze.
    rest = [float(np.median(opening[pieces[at]])) for at in often]
    middle = [float(np.median(pitch_deg[pieces[at]])) for at in often]
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
    finder, found, last_s = BlinkFinder(), [], float(t_s[0])
    for now_s, one in zip(t_s.tolist(), share.tolist(), strict=True):
        if now_s - last_s > _GAP_S:
            finder.clear()
        last_s = now_s
        blink = finder.update(now_s, one)
        if blink is not None:
            found.append(blink)
    return tuple(found)

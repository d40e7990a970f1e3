"""Openings of a rig's lids, and the blinks in a trace of them.

A blink closes both lids by half or more and opens them again; lids that follow the gaze down stay
down. Closing and opening last while the lid is faster than a twentieth of the phase's peak speed,
as blink kinematics are usually measured (VanderWerf et al. 2003).
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

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

    def update(self, t_s: float, left: float, right: float) -> BlinkEvent | None:
        """Add both openings, 0 shut .. 1 open; return the blink that has just ended, if any."""
        opening = left if left > right else right  # a wink is not a blink
        trace = self._trace
        if not trace:
            self._usual = opening
        elif t_s <= trace[-1][0]:
            return None
        else:
            if self._shut_s is None:  # quickly up and slowly down
                share = (t_s - trace[-1][0]) / _OPEN_S
                self._usual += (opening - self._usual) * min(1.0, 4 * share if opening > self._usual
                                                             else share)  # fmt: skip
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


def lid_openings(
    left: float, right: float, names: Sequence[str], pair: tuple[str, str]
) -> tuple[float, float] | None:
    """Return the openings of two lids, None without lids; a single lid counts for both.

    pair: joints of the left and the right lid; names: joints of the rig; empty: all joints
    """
    if not names:
        return left, right
    there = [o for name, o in zip(pair, (left, right), strict=True) if name in names]
    return (there[0], there[-1]) if there else None

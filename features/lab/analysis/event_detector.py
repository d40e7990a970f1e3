"""Saccades and fixations in a trace of the gaze, found as by an eye tracker.

All values are measured at the servos: the mean of both lines of sight in space. Without feedback
they are estimated from the goals. The commanded saccade is stored with the measured one, so that
both can be compared.

The speed is that of Engbert & Kliegl 2003, a central difference over five samples. It is relative
to the slow motion of the last 50 ms, so that pursuit of a walking person is not a saccade. 30 deg/s
above that is the usual threshold of velocity-based detection (I-VT).
"""

from collections import Counter
from math import exp, inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import PARTS, Floats

THRESHOLD_DEG_S = 30.0
"""Relative speed at which a saccade begins; one servo step of both eyes per tick is half of it."""

LEAST_DEG = 0.5
"""Smaller saccades cannot be distinguished from encoder steps."""

_FOOT_SHARE, _FOOT_DEG_S = 0.1, 10.0
"""A saccade lasts while its speed is above this fraction of its peak, and above this speed."""

_TOP_SHARE = 0.9
"""The time of the peak is the middle of the interval above this fraction: capped peaks are flat."""

_SWING_SHARE, _AGAIN_SHARE = 0.35, 0.5
"""A minimum below the first fraction of the peak is the landing, even while a servo swings back
(the glissade of Nystroem & Holmqvist 2010). Later motion above the second fraction is a new
saccade."""

_LANDING_S = 0.15

_SLOW_S = 0.05
_FARTHEST_S = 0.044
"""Five samples over a longer time do not give the speed of a saccade, three do."""

_NEAREST_S = 0.0035
"""Samples at shorter intervals are skipped: their differences are only encoder steps."""

_GAP_S = 0.06
"""A longer gap between two rows ends a stretch."""
_LONGEST_S = 0.4

_LOOK_EVERY_S = 0.024
"""Interval at which the part is determined during a fixation."""

SHORTEST_S = 0.04
"""Shortest fixation between two saccades."""

_SETTLING_S = 0.02
"""Delay after a saccade before the part is determined."""

_COMMAND_BEFORE_S, _COMMAND_AFTER_S = 0.12, 0.03


class CommandedSaccade(NamedTuple):
    """Saccade commanded by the models."""

    onset_s: float
    duration_s: float
    amplitude_deg: float
    peak_deg_s: float


class SaccadeEvent(NamedTuple):
    """One saccade of the gaze in space.

    peak_share: time of the peak speed as a fraction of the duration; .5 is symmetric
    commanded: the commanded saccade, None if the eyes jumped without a command
    """

    onset_s: float
    duration_s: float
    amplitude_deg: float
    peak_deg_s: float
    peak_share: float
    commanded: CommandedSaccade | None = None

    @property
    def end_s(self) -> float:
        """Return the time of the landing."""
        return self.onset_s + self.duration_s


class FixationEvent(NamedTuple):
    """Fixation of the gaze between two saccades, on one place or on a moving target.

    part: the face part nearest to the lines of sight, None off the parts
    on_face: whether it was on any face
    is_face: whether the target was a face
    """

    start_s: float
    duration_s: float
    part: str | None
    on_face: bool
    is_face: bool

    @property
    def end_s(self) -> float:
        """Return the start of the next saccade."""
        return self.start_s + self.duration_s


class _Speeds:
    """Speeds of a stretch: all arrays are (n,), or (n, 3) for vectors.

    velocity_1_s: smoothed velocity of the unit vector; sharp_deg_s: speed over three samples only,
    for the peak; relative_deg_s: speed relative to the slow motion, as far as it is known
    """

    def __init__(self, t_s: Floats, way: Floats) -> None:
        self.t_s, self.way = t_s[2:-2], way[2:-2]
        self.step_s, wide_s = t_s[3:-1] - t_s[1:-3], t_s[4:] - t_s[:-4]
        near = way[3:-1] - way[1:-3]
        wide_s = np.where(wide_s < _FARTHEST_S, wide_s, 0.0)
        far = (way[4:] - way[:-4]) * (wide_s > 0.0)[:, None]
        self.velocity_1_s = (near + far) / (self.step_s + wide_s)[:, None]
        self.sharp_deg_s = np.degrees(np.linalg.norm(near, axis=1) / self.step_s)
        self.relative_deg_s = np.zeros(len(near))

    def saccade(self, end: int, foot: float, began_s: float, barrier_s: float) -> SaccadeEvent:
        """Return the saccade whose last speed is the one before ``end``."""
        t, first = self.t_s, end - 1
        while first > 0 and t[first - 1] >= barrier_s:
            first -= 1
            if self.relative_deg_s[first] < foot and t[first] < began_s:
                break
        onset_s = self._crossing_s(first, first + 1, foot)
        duration_s = self._crossing_s(end - 1, end - 2, foot) - onset_s
        inner = slice(first + 1, end - 1) if end - first > 2 else slice(first, end)
        sharp = self.sharp_deg_s[inner]
        top = t[inner][sharp >= _TOP_SHARE * sharp.max()]
        return SaccadeEvent(
            onset_s,
            duration_s,
            float(angles_deg(self.way[first], self.way[end - 1])),
            float(sharp.max()),
            float((0.5 * (top[0] + top[-1]) - onset_s) / duration_s),
        )

    def _crossing_s(self, below: int, above: int, level: float) -> float:
        """Return the time when the speed crossed a level between two samples."""
        low, high = self.relative_deg_s[[below, above]].tolist()
        share = (level - low) / (high - low) if high > low else 0.0
        start_s, end_s = self.t_s[[below, above]].tolist()
        return float(start_s + min(1.0, max(0.0, share)) * (end_s - start_s))


def angles_deg(a: Floats, b: Floats) -> Floats:
    """Return the angles between unit vectors (..., 3)."""
    return np.asarray(np.degrees(2.0 * np.arcsin(0.5 * np.linalg.norm(a - b, axis=-1))))


def find_saccades(
    t_s: Floats, way: Floats
) -> tuple[list[tuple[int, SaccadeEvent]], NDArray[np.bool_]]:
    """Find the saccades in a stretch without gaps.

    Args:
        t_s: (n,) Times.
        way: (n, 3) Unit directions of the gaze in the world.

    Returns:
        Each saccade with the row at which it is over; (n,) whether a row is in flight.
    """
    flying, kept = np.zeros(len(t_s), dtype=bool), list[int]()
    for row, now_s in enumerate(t_s.tolist()):
        if not kept or now_s - t_s[kept[-1]] >= _NEAREST_S:
            kept.append(row)
    if len(kept) < 5:
        return [], flying
    speeds, found = _Speeds(t_s[kept], way[kept]), list[tuple[int, SaccadeEvent]]()
    slow, in_flight, settles_s, barrier_s = np.zeros(3), False, inf, -inf
    peak = before = began_s = 0.0
    for at, (row, end) in enumerate(zip(kept[4:], [*kept[5:], len(t_s)], strict=True)):
        now_s, velocity = float(speeds.t_s[at]), speeds.velocity_1_s[at]
        now = float(np.degrees(np.linalg.norm(velocity - slow)))
        speeds.relative_deg_s[at] = now
        if not in_flight and now <= THRESHOLD_DEG_S:
            slow = slow + (1.0 - exp(-0.5 * speeds.step_s[at] / _SLOW_S)) * (velocity - slow)
        lasts_long = False
        if settles_s < inf:  # after a landing
            lasts_long = now_s - settles_s > _LANDING_S
            if now < THRESHOLD_DEG_S or lasts_long:
                settles_s, in_flight = inf, False
            elif now > _AGAIN_SHARE * peak:
                settles_s, peak, began_s = inf, now, now_s
        elif in_flight:
            # Relative to the peak so far: a saccade is also slow at its beginning.
            swings = before < _SWING_SHARE * peak and now > before
            peak = max(peak, now)
            foot = max(_FOOT_SHARE * peak, _FOOT_DEG_S)
            lasts_long = now_s - began_s > _LONGEST_S
            if now < foot or swings:
                saccade = speeds.saccade(at + 1 - swings, foot, began_s, barrier_s)
                barrier_s, in_flight, lasts_long = saccade.end_s, now > THRESHOLD_DEG_S, False
                settles_s = now_s if in_flight else inf
                if saccade.amplitude_deg >= LEAST_DEG:
                    found.append((row, saccade))
        elif now > THRESHOLD_DEG_S:
            in_flight, peak, began_s = True, now, now_s
        if lasts_long:  # slow motion
            in_flight, slow, barrier_s = False, velocity, now_s
        before = now
        flying[row:end] = in_flight
    return found, flying


def find_events(
    rows: NDArray[np.void], flies: NDArray[np.bool_]
) -> tuple[tuple[SaccadeEvent, ...], tuple[FixationEvent, ...]]:
    """Return the saccades of a run and the fixations before them.

    Args:
        rows: (n,) Columns t, way, plan, part, on_any_face, is_face and measured of a trace.
        flies: (n,) Whether the models make a saccade.
    """
    saccades, fixations = list[SaccadeEvent](), list[FixationEvent]()
    cuts = np.flatnonzero((np.diff(rows["t"]) > _GAP_S) | (np.diff(rows["measured"]) != 0.0)) + 1
    for stretch, flight in zip(np.split(rows, cuts), np.split(flies, cuts), strict=True):
        if not stretch["measured"].any():
            continue
        found, in_flight = find_saccades(stretch["t"], stretch["way"])
        changes = np.flatnonzero(np.diff(flight.astype(int), prepend=0, append=0))
        flights = [slice(a, b) for a, b in changes.reshape(-1, 2).tolist()]
        start_s, first = float(stretch["t"][0]), 0
        for row, saccade in found:
            if saccade.onset_s - start_s >= SHORTEST_S:
                still = stretch[first:row][~in_flight[first:row]]
                fixations.append(_fixation(still, start_s, saccade.onset_s))
            command = _take_command(stretch, flights, row, saccade.onset_s)
            saccades.append(saccade._replace(commanded=command))
            start_s, first = saccade.end_s, row + 1
    return tuple(saccades), tuple(fixations)


def _fixation(rows: NDArray[np.void], start_s: float, end_s: float) -> FixationEvent:
    """Return what was fixated between two saccades."""
    looks, next_s = list[int](), start_s + _SETTLING_S
    for row, now_s in enumerate(rows["t"].tolist()):
        if now_s >= next_s:
            looks.append(row)
            next_s = now_s + _LOOK_EVERY_S
    part, on_face, is_face = (
        Counter(rows[name][looks].tolist()).most_common(1)[0][0] if looks else -1.0
        for name in ("part", "on_any_face", "is_face")
    )
    name = PARTS[int(part)] if part >= 0.0 else None
    return FixationEvent(start_s, end_s - start_s, name, on_face > 0.0, is_face > 0.0)


def _take_command(
    rows: NDArray[np.void], flights: list[slice], row: int, onset_s: float
) -> CommandedSaccade | None:
    """Return the command of a saccade, which is measured later by the lag of the servo."""
    for flight in reversed(flights):
        late_s = onset_s - rows["t"][flight.start]
        if flight.start <= row and -_COMMAND_AFTER_S <= late_s <= _COMMAND_BEFORE_S:
            if flight.stop <= row:
                flights.remove(flight)  # an eye swings back without a command
            part = rows[flight.start : min(flight.stop, row) + 1]
            t, plan = part["t"], part["plan"]
            speeds = angles_deg(plan[1:], plan[:-1]) / np.diff(t)
            size, fastest = float(angles_deg(plan[0], plan[-1])), float(speeds.max(initial=0.0))
            return CommandedSaccade(float(t[0]), float(t[-1] - t[0]), size, fastest)
    return None

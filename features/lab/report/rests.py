"""Durations of gaze rests, small shifts within a part, and shifts without a person."""

import numpy as np

from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.landing import planned_saccades
from gazerig.features.lab.report.statistics import MeasuredValue, mean
from gazerig.gaze.types import Floats

SHORT_S, SLOT_S = 0.15, 0.01

_SPIKES_S = (0.04, 1.0)
_NEAR_SLOTS = 5
_SMALL_DEG = (0.4, 1.5)
_PIECE_S = 5.0
_BRIDGED_S = 0.15


def face_rests(run: GazeTrace) -> Floats:
    """Return (n,) seconds of each rest on a face, from landing to the shift to another target.

    Corrections, catch-up saccades and small shifts within a part are within the rest.
    """
    t, shift = run.column("t"), run.column("shift")
    rests: list[tuple[float, float, float]] = []  # target, begin, end
    for f in run.fixations:
        if not f.on_face:
            continue
        middle = min(int(np.searchsorted(t, f.start_s + 0.5 * f.duration_s)), len(t) - 1)
        target = float(shift[middle]) if len(t) else len(rests)
        if rests and rests[-1][0] == target and f.start_s - rests[-1][2] < _BRIDGED_S:
            rests[-1] = target, rests[-1][1], f.end_s
        else:
            rests.append((target, f.start_s, f.end_s))
    return np.array([end - begin for _, begin, end in rests])


def largest_slot_excess(rests_s: Floats) -> float:
    """Return the largest excess share of rests in one slot of 10 ms over its neighbours.

    A plausible law of dwell times is smooth; a lower limit accumulates rests at one duration. The
    slot is chosen by every second rest and measured by the others, and vice versa, because by
    chance alone the fullest of a hundred slots exceeds the law.
    """
    one, other = _beyond_neighbours(rests_s[::2]), _beyond_neighbours(rests_s[1::2])
    return 0.5 * float(other[np.argmax(one)] + one[np.argmax(other)])


def _beyond_neighbours(rests_s: Floats) -> Floats:
    """Return the excess share of rests in each slot over its neighbours."""
    edges = np.arange(_SPIKES_S[0], _SPIKES_S[1] + SLOT_S, SLOT_S)
    share = np.histogram(rests_s, edges)[0] / max(1, len(rests_s))
    near = np.ones(2 * _NEAR_SLOTS + 1)
    near[_NEAR_SLOTS - 1 : _NEAR_SLOTS + 2] = 0.0
    inside = np.convolve(np.ones_like(share), near, "same")
    return np.asarray(share - np.convolve(share, near, "same") / inside)


def small_shifts(run: GazeTrace) -> Floats:
    """Return (n, 2) shifts of .4 to 1.5 deg on a face, and seconds on one, per piece of the run."""
    jumps = planned_saccades(run)
    size = jumps[:, 2]
    small = jumps[(size >= _SMALL_DEG[0]) & (size <= _SMALL_DEG[1]) & (jumps[:, 3] > 0.0)]
    return _events_per_piece(run, small[:, 0], run.column("on_face") > 0.0)


def idle_shifts(run: GazeTrace) -> Floats:
    """Return (n, 2) saccades and seconds without a person, per piece of the run."""
    idle = run.column("idle") > 0.0
    onsets = planned_saccades(run)[:, 0]
    at = np.searchsorted(run.column("t"), onsets)
    return _events_per_piece(run, onsets[idle[at]] if len(onsets) else onsets, idle)


def _events_per_piece(run: GazeTrace, onsets_s: Floats, here: np.ndarray) -> Floats:
    t = run.column("t")
    if len(t) < 2:
        return np.zeros((0, 2))
    edges = np.append(np.arange(t[0], t[-1], _PIECE_S), t[-1] + 1e-6)
    counts, _ = np.histogram(onsets_s, edges)
    seconds, _ = np.histogram(t[here], edges)
    rows = np.column_stack([counts, seconds / run.rate_hz])
    return np.asarray(rows[rows[:, 1] > 0.0])


def rate_per_second(rows: Floats) -> float:
    """Return events a second of (n, 2) events and seconds."""
    return float(rows[:, 0].sum() / rows[:, 1].sum())


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of rests."""
    rests, small, idle = face_rests(run), small_shifts(run), idle_shifts(run)
    return [
        MeasuredValue("short_rests", (rests < SHORT_S).astype(float), mean),
        MeasuredValue("rest_spike", rests, largest_slot_excess),
        MeasuredValue("refixations", small, rate_per_second, count=round(small[:, 1].sum())),
        MeasuredValue("idle_rate", idle, rate_per_second, count=round(idle[:, 1].sum())),
    ]

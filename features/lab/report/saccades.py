"""Saccades of a run beside the human main sequence: landings, rests between them."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.event_detector import CommandedSaccade, SaccadeEvent
from gazerig.features.lab.report.gaze_trace import PHASES, GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, median, rate
from gazerig.gaze.types import Floats

LEAST_DEG = 1.0
"""Smaller saccades depend on the threshold and the encoder's resolution."""

_SOON_S, _PAUSE_S = 0.1, 2.0

FAR_DEG = 10.0
"""Size above which people's saccades fall short."""

_LANDED_S = 0.02, 0.04
_LANDS_S = 0.06
_CORRECTION_S = (0.08, 0.35)
SHORT_S = 0.15
_SMALL_DEG = (0.4, 1.5)
_PIECE_S = 5.0
_BRIDGED_S = 0.15


class HumanCurves(NamedTuple):
    """A measure by human curves over amplitudes.

    column: column of the table of saccades; low, high: human limits over amplitudes in deg
    """

    key: str
    smallest_deg: float
    largest_deg: float
    column: int
    low: Callable[[Floats], Floats]
    high: Callable[[Floats], Floats]

    def inside(self, rows: Floats) -> Floats:
        """Return whether each saccade of these sizes is between the curves."""
        a = rows[(rows[:, 0] >= self.smallest_deg) & (rows[:, 0] < self.largest_deg)]
        value, size = a[:, self.column], a[:, 0]
        return ((value >= self.low(size)) & (value <= self.high(size))).astype(float)


_PEAK = 2, human.lowest_peak_deg_s, human.highest_peak_deg_s
_DURATION = 1, human.shortest_duration_ms, human.longest_duration_ms
_CURVES = (
    HumanCurves("peak_small", LEAST_DEG, 8.0, *_PEAK),
    HumanCurves("peak_large", 8.0, 999.0, *_PEAK),
    HumanCurves("duration_small", LEAST_DEG, 12.0, *_DURATION),
    HumanCurves("duration_large", 12.0, 999.0, *_DURATION),
)


def commanded(run: GazeTrace) -> list[SaccadeEvent]:
    """Return the saccades that were commanded: the swing of a servo is not a saccade."""
    return [saccade for saccade in run.saccades if saccade.commanded is not None]


def saccade_table(run: GazeTrace) -> Floats:
    """Return (n, 4) amplitude in deg, duration in ms, peak in deg/s, time of the peak 0..1."""
    every = [s for s in commanded(run) if s.amplitude_deg >= LEAST_DEG]
    return np.column_stack([_main_sequence(every), [s.peak_share for s in every]])


def commanded_saccade_table(run: GazeTrace) -> Floats:
    """Return (n, 3) amplitude in deg, duration in ms and peak in deg/s as commanded."""
    asked = (saccade.commanded for saccade in run.saccades)
    return _main_sequence([c for c in asked if c is not None and c.amplitude_deg >= LEAST_DEG])


def planned_saccades(run: GazeTrace) -> Floats:
    """Return (n, 4) of each saccade that the models planned.

    Columns: onset and end in s, measured gaze amplitude in deg, and 1 on a face.
    """
    t, gaze = run.column("t"), run.column("gaze")
    rows = []
    for flight in run.slices(run.column("phase") == PHASES.index("saccade")):
        first, last = flight.start, flight.stop
        landed = run.between(t[min(last, len(t) - 1)] + _LANDED_S[0], t[last - 1] + _LANDS_S)
        if landed.stop > landed.start:
            gone = np.median(gaze[landed], axis=0) - gaze[first]
            on_face = run.column("is_face")[first]
            rows.append((t[first], t[last - 1], float(np.hypot(*gone)), on_face))
    return np.array(rows).reshape(-1, 4)


def landing_errors(run: GazeTrace) -> Floats:
    """Return (n, 2) of saccades to targets 10 deg away and more: share of the distance, corrected.

    Saccades that end at the end of an eye's range are left out: the head completes them.

    corrected: 1 if another saccade to the same target follows within .35 s
    """
    t, shift = run.column("t"), run.column("shift")
    gaze, target = run.column("gaze"), run.column("target")
    jumps, limited = planned_saccades(run), run.column("eye_limited")
    rows = []
    for number, (onset_s, end_s, _, _) in enumerate(jumps):
        first = run.between(onset_s, end_s).start
        landed = run.between(end_s + _LANDED_S[0], end_s + _LANDED_S[1])
        if landed.stop <= landed.start or shift[first] != shift[landed.start]:
            continue
        if limited[first : landed.stop].any():
            continue
        way = target[landed].mean(axis=0) - gaze[first]
        far = float(np.hypot(*way))
        if far < FAR_DEG:
            continue
        share = float((np.median(gaze[landed], axis=0) - gaze[first]) @ way) / far**2
        corrected = 0.0
        if number + 1 < len(jumps):
            next_s = jumps[number + 1, 0]
            same = shift[np.searchsorted(t, next_s)] == shift[np.searchsorted(t, onset_s)]
            corrected = float(same and _CORRECTION_S[0] <= next_s - end_s <= _CORRECTION_S[1])
        rows.append((share, corrected))
    return np.array(rows).reshape(-1, 2)


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
        begin_s = f.start_s
        if rests and rests[-1][0] == target and f.start_s - rests[-1][2] < _BRIDGED_S:
            _, begin_s, _ = rests.pop()
        rests.append((target, begin_s, f.end_s))
    return np.array([end - begin for _, begin, end in rests])


def rest_errors(run: GazeTrace) -> Floats:
    """Return per fixation the median angle of the lines of sight from the target, in deg."""
    off = run.column("off").mean(axis=1)
    parts = [off[run.between(f.start_s + 0.04, f.end_s)] for f in run.fixations]
    return np.array([np.median(part) for part in parts if len(part)])


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of saccades, landings and rests."""
    seen, asked, every = saccade_table(run), commanded_saccade_table(run), commanded(run)
    onsets, ends = np.array([(s.onset_s, s.end_s) for s in every]).reshape(-1, 2).T
    pauses = onsets[1:] - ends[:-1]
    pauses = pauses[pauses < _PAUSE_S]
    unasked = [s.commanded is None for s in run.saccades if s.amplitude_deg >= LEAST_DEG]
    landed, rests_s, jumps = landing_errors(run), face_rests(run), planned_saccades(run)
    small = (jumps[:, 2] >= _SMALL_DEG[0]) & (jumps[:, 2] <= _SMALL_DEG[1]) & (jumps[:, 3] > 0.0)
    shifts = _events_per_piece(run, jumps[small, 0], run.column("on_face") > 0.0)
    idle = run.column("idle") > 0.0
    starts = jumps[:, 0]
    if len(starts):
        starts = starts[idle[np.searchsorted(run.column("t"), starts)]]
    searches = _events_per_piece(run, starts, idle)
    return [
        *(
            MeasuredValue(curves.key, curves.inside(seen), mean, curves.inside(asked))
            for curves in _CURVES
        ),
        MeasuredValue("skew", seen[:, 3] - human.acceleration_share(seen[:, 0]), median),
        MeasuredValue("below_15", (seen[:, 0] < 15.0).astype(float), mean),
        MeasuredValue("rate", np.diff(onsets), lambda gaps: 1.0 / mean(gaps)),
        MeasuredValue("too_soon", (pauses < _SOON_S).astype(float), mean),
        MeasuredValue("unasked", np.array(unasked, dtype=float), mean),
        MeasuredValue("rest_error", rest_errors(run), median),
        MeasuredValue("landing", landed[:, 0], median),
        MeasuredValue("corrected", landed[:, 1], mean),
        MeasuredValue("short_rests", (rests_s < SHORT_S).astype(float), mean),
        MeasuredValue("refixations", shifts, rate, count=round(shifts[:, 1].sum())),
        MeasuredValue("idle_rate", searches, rate, count=round(searches[:, 1].sum())),
    ]


def _main_sequence(events: Sequence[SaccadeEvent] | Sequence[CommandedSaccade]) -> Floats:
    """Return (n, 3) amplitude in deg, duration in ms and peak in deg/s."""
    rows = [(one.amplitude_deg, 1e3 * one.duration_s, one.peak_deg_s) for one in events]
    return np.array(rows).reshape(-1, 3)


def _events_per_piece(run: GazeTrace, onsets_s: Floats, here: NDArray[np.bool_]) -> Floats:
    """Return (n, 2) events and seconds with a true mask, per piece of the run."""
    t = run.column("t")
    if len(t) < 2:
        return np.zeros((0, 2))
    edges = np.append(np.arange(t[0], t[-1], _PIECE_S), t[-1] + 1e-6)
    counts, _ = np.histogram(onsets_s, edges)
    ticks, _ = np.histogram(t[here], edges)
    rows = np.column_stack([counts, ticks / run.rate_hz])
    return np.asarray(rows[ticks > 0])

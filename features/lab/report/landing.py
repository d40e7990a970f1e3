"""Landing points of saccades: overshoot, undershoot and corrections."""

import numpy as np

from gazerig.features.lab.report.gaze_trace import PHASES, GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, median
from gazerig.gaze.types import Floats

OVERSHOOT_DEG = (5.0, 20.0)
FAR_DEG = 10.0
"""Size above which people's saccades fall short."""

_SETTLED_S = (0.06, 0.1)
_LANDED_S = (0.02, 0.04)
_STILL_DEG_S = 8.0
_CORRECTION_S = (0.08, 0.35)


def planned_saccades(run: GazeTrace) -> Floats:
    """Return (n, 4) of each saccade that the models planned.

    Columns: onset and end in s, measured gaze amplitude in deg, and 1 on a face.
    """
    t, flying = run.column("t"), run.column("phase") == PHASES.index("saccade")
    gaze = run.columns("gaze_yaw", "gaze_pitch")
    edges = np.flatnonzero(np.diff(flying.astype(int), prepend=0, append=0)).reshape(-1, 2)
    rows = []
    for first, last in edges:
        landed = run.between(t[min(last, len(t) - 1)] + _LANDED_S[0], t[last - 1] + 0.06)
        if landed.stop > landed.start:
            gone = np.median(gaze[landed], axis=0) - gaze[first]
            on_face = run.column("is_face")[first]
            rows.append((t[first], t[last - 1], float(np.hypot(*gone)), on_face))
    return np.array(rows).reshape(-1, 4)


def overshoots(run: GazeTrace) -> Floats:
    """Return (n,) the overshoot of each saccade of 5 to 20 deg, as a share of its amplitude."""
    rows, gaze = [], run.columns("gaze_yaw", "gaze_pitch")
    moves = np.hypot(run.column("target_yaw_rate"), run.column("target_pitch_rate"))
    asked = [s for s in run.saccades if s.commanded is not None]
    onsets = [*(s.onset_s for s in asked), np.inf]
    for saccade, next_s in zip(asked, onsets[1:], strict=True):
        rest = run.between(saccade.end_s + _SETTLED_S[0], saccade.end_s + _SETTLED_S[1])
        flight = run.between(saccade.onset_s - 0.01, saccade.end_s + _SETTLED_S[1])
        small = not OVERSHOOT_DEG[0] <= saccade.amplitude_deg <= OVERSHOOT_DEG[1]
        if small or next_s < saccade.end_s + _SETTLED_S[1] or rest.stop <= rest.start:
            continue
        if float(np.median(moves[rest])) > _STILL_DEG_S:
            continue
        path = gaze[flight]
        whole = np.median(gaze[rest], axis=0) - path[0]
        size = float(np.hypot(*whole))
        farthest = float(((path - path[0]) @ whole).max()) / size
        rows.append(max(0.0, farthest / size - 1.0))
    return np.array(rows)


def landing_errors(run: GazeTrace) -> Floats:
    """Return (n, 2) of saccades to targets 10 deg away and more: share of the distance, corrected.

    Saccades that end at the end of an eye's range are left out: the head completes them.

    corrected: 1 if another saccade to the same target follows within .35 s
    """
    t, shift = run.column("t"), run.column("shift")
    gaze, target = run.columns("gaze_yaw", "gaze_pitch"), run.columns("target_yaw", "target_pitch")
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


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of landings."""
    landed = landing_errors(run)
    return [
        MeasuredValue("overshoot", overshoots(run), median),
        MeasuredValue("landing", landed[:, 0], median),
        MeasuredValue("corrected", landed[:, 1], mean),
    ]

"""Saccades of a run and the human main sequence."""

from collections.abc import Callable

import numpy as np

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    mean,
    measured_value,
    median,
    one_over_mean,
)
from gazerig.gaze.types import Floats

LEAST_DEG = 1.0
"""Smaller saccades depend on the threshold and the encoder's resolution."""

_SMALL_PEAK_DEG, _SMALL_DURATION_DEG = 8.0, 12.0
_SOON_S, _PAUSE_S = 0.1, 2.0

EXPRESS_MS = 120.0
"""Faster reactions are express saccades."""


def saccade_table(run: GazeTrace) -> Floats:
    """Return (n, 4) amplitude in deg, duration in ms, peak in deg/s, time of the peak 0..1.

    Only commanded saccades count: the swing of a servo is not a saccade.
    """
    rows = [
        (s.amplitude_deg, 1e3 * s.duration_s, s.peak_deg_s, s.peak_share)
        for s in run.saccades
        if s.commanded is not None and s.amplitude_deg >= LEAST_DEG
    ]
    return np.array(rows).reshape(-1, 4)


def commanded_saccade_table(run: GazeTrace) -> Floats:
    """Return (n, 3) amplitude in deg, duration in ms and peak in deg/s as commanded."""
    asked = [s.commanded for s in run.saccades if s.commanded is not None]
    rows = [(c.amplitude_deg, 1e3 * c.duration_s, c.peak_deg_s) for c in asked]
    found = np.array(rows).reshape(-1, 3)
    return found[found[:, 0] >= LEAST_DEG]


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of saccades."""
    seen, asked = saccade_table(run), commanded_saccade_table(run)
    every = [s for s in run.saccades if s.amplitude_deg >= LEAST_DEG]
    unasked = np.array([s.commanded is None for s in every], dtype=float)
    onsets = np.array([s.onset_s for s in run.saccades if s.commanded is not None])
    ends = np.array([s.end_s for s in run.saccades if s.commanded is not None])
    pauses = onsets[1:] - ends[:-1]
    pauses = pauses[pauses < _PAUSE_S]
    skew = seen[:, 3] - human.acceleration_share(seen[:, 0])
    return [
        *(_share_inside(seen, asked, *curves) for curves in _CURVES),
        MeasuredValue("skew", skew, median),
        MeasuredValue("below_15", (seen[:, 0] < 15.0).astype(float), mean),
        MeasuredValue("rate", np.diff(onsets), one_over_mean),
        MeasuredValue("too_soon", (pauses < _SOON_S).astype(float), mean),
        MeasuredValue("unasked", unasked, mean),
        MeasuredValue("rest_error", rest_errors(run), median),
    ]


_CURVES = (
    (
        "peak_small",
        LEAST_DEG,
        _SMALL_PEAK_DEG,
        2,
        human.lowest_peak_deg_s,
        human.highest_peak_deg_s,
    ),
    ("peak_large", _SMALL_PEAK_DEG, 999.0, 2, human.lowest_peak_deg_s, human.highest_peak_deg_s),
    (
        "duration_small",
        LEAST_DEG,
        _SMALL_DURATION_DEG,
        1,
        human.shortest_duration_ms,
        human.longest_duration_ms,
    ),
    (
        "duration_large",
        _SMALL_DURATION_DEG,
        999.0,
        1,
        human.shortest_duration_ms,
        human.longest_duration_ms,
    ),
)
"""Measures by human curves: key, smallest and largest amplitude in deg, column, lower and upper
curve over amplitudes."""


def _share_inside(
    seen: Floats, asked: Floats, key: str, low_deg: float, high_deg: float, column: int,
    lower: Callable[[Floats], Floats], upper: Callable[[Floats], Floats],
) -> MeasuredValue:  # fmt: skip
    """Return whether a column of each saccade is between two human curves."""

    def inside(rows: Floats) -> Floats:
        a = rows[(rows[:, 0] >= low_deg) & (rows[:, 0] < high_deg)]
        fits = (a[:, column] >= lower(a[:, 0])) & (a[:, column] <= upper(a[:, 0]))
        return fits.astype(float)

    return MeasuredValue(key, inside(seen), mean, measured_value(mean, inside(asked)))


def rest_errors(run: GazeTrace) -> Floats:
    """Return per fixation the median angle of the lines of sight from the target, in deg."""
    off = 0.5 * (run.column("off_left") + run.column("off_right"))
    parts = [off[run.between(f.start_s + 0.04, f.end_s)] for f in run.fixations]
    return np.array([np.median(part) for part in parts if len(part)])


def reaction_measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of reactions: latency of the gaze to things that come into view."""
    latency_ms = np.array([1e3 * reaction.latency_s for reaction in run.reactions])
    return [
        MeasuredValue("reaction", latency_ms, median),
        MeasuredValue("express", (latency_ms < EXPRESS_MS).astype(float), mean),
    ]

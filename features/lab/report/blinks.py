"""Blinks: their rate, their shape, and gaze shifts that evoke them."""

from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.analysis.blink_finder import BlinkEvent
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, median, rate
from gazerig.gaze.types import Floats

_DOUBLE_S = 0.6
_EVOKING_DEG = 33.0
_WITH_BEFORE_S, _WITH_AFTER_S = 0.12, 0.2
_AGAIN_S = 0.3
"""Time after a blink within which a blink with a gaze shift would be a double blink."""

_PART_S = 10.0
_TIED_S = 0.006
_SHUT = 0.96
"""Depth of a blink that counts as shut, given the resolution of a servo."""

SHAPES = ("blink_close", "blink_hold", "blink_open", "blink_ratio")
"""Measures of the columns of ``blink_shapes``."""


def blink_shapes(blinks: Sequence[BlinkEvent]) -> Floats:
    """Return (n, 4) closing, shut and opening in ms, and fastest closing over fastest opening."""
    rows = [
        (1e3 * b.close_s, 1e3 * b.hold_s, 1e3 * b.open_s, b.close_peak_1_s / b.open_peak_1_s)
        for b in blinks
    ]
    return np.array(rows).reshape(-1, 4)


def evoked_blinks(run: GazeTrace) -> Floats:
    """Return (n,) whether a blink accompanied each large gaze shift.

    Shifts during an earlier blink are omitted, because shut eyes cannot blink.
    """
    onsets = np.array([blink.onset_s for blink in run.blinks])
    opened = onsets + np.array([blink.duration_s for blink in run.blinks])
    rows = []
    for saccade in run.saccades:
        if saccade.commanded is None:
            continue
        if max(saccade.commanded.amplitude_deg, saccade.amplitude_deg) < _EVOKING_DEG:
            continue
        since = onsets - saccade.onset_s
        if not ((since <= -_WITH_BEFORE_S) & (opened + _AGAIN_S > saccade.onset_s)).any():
            rows.append(((since > -_WITH_BEFORE_S) & (since < _WITH_AFTER_S)).any())
    return np.array(rows, dtype=float)


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of lids."""
    seen, asked = blink_shapes(run.blinks), blink_shapes(run.asked_blinks)
    onsets = np.array([blink.onset_s for blink in run.blinks])
    gaps = np.diff(onsets)
    saccades = [saccade.onset_s for saccade in run.saccades] or [-np.inf]
    tied = np.array([np.abs(np.array(saccades) - onset).min() <= _TIED_S for onset in onsets])
    partial = np.array([blink.depth < _SHUT for blink in run.blinks], dtype=float)
    counts = _counts(run, onsets)
    due = np.array([(60.0 * len(run.asked_blinks), run.seconds)] if run.seconds else [])
    rates = [
        MeasuredValue(key, counts, rate, due, len(run.blinks))
        for key in ("blink_rate", "blink_rate_talk")
    ]
    shapes = [
        MeasuredValue(key, seen[:, column], median, asked[:, column])
        for column, key in enumerate(SHAPES)
    ]
    return [
        *rates,
        # A double blink counts once.
        MeasuredValue("blink_cv", gaps[gaps > _DOUBLE_S], _spread_over_mean),
        *shapes,
        MeasuredValue("evoked", evoked_blinks(run), mean),
        MeasuredValue("blink_partial", partial, mean),
        MeasuredValue("blink_tied", tied.astype(float), mean),
    ]


def _counts(run: GazeTrace, onsets: Floats) -> Floats:
    """Return (n, 2) blinks and minutes in each ten seconds of the run."""
    if not len(run.rows):
        return np.zeros((0, 2))
    first, last = run.column("t")[[0, -1]]
    edges = np.append(np.arange(first, last, _PART_S), last)
    seen, _ = np.histogram(onsets, bins=edges)
    return np.column_stack([seen, np.diff(edges) / 60.0])


def _spread_over_mean(rows: Floats) -> float:
    """Return the standard deviation over the mean."""
    return float(np.std(rows, ddof=1) / np.mean(rows)) if len(rows) > 1 else np.nan

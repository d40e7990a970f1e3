"""Blinks: their rate and their shape."""

from collections.abc import Sequence

import numpy as np

from gazerig.features.lab.analysis.blink_finder import BlinkEvent
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, median, rate
from gazerig.gaze.types import Floats

_DOUBLE_S = 0.6
_PART_S = 10.0
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


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of lids."""
    seen, asked = blink_shapes(run.blinks), blink_shapes(run.asked_blinks)
    onsets = np.array([blink.onset_s for blink in run.blinks])
    gaps = np.diff(onsets)
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
        MeasuredValue("blink_partial", partial, mean),
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
    return float(np.std(rows, ddof=1) / np.mean(rows)) if len(rows) > 1 else np.nan

"""Blinks: their rate, their shape, and gaze shifts that evoke them."""

from collections.abc import Sequence
from math import nan

import numpy as np

from gazerig.features.lab.analysis.blink_finder import BlinkEvent
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import (
    MeasuredValue,
    mean,
    measured_value,
    median,
    spread_over_mean,
)
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


def blink_intervals(run: GazeTrace) -> Floats:
    """Return the intervals between blinks in seconds; a double blink counts once."""
    onsets = np.array([blink.onset_s for blink in run.blinks])
    apart = np.diff(onsets)
    return apart[apart > _DOUBLE_S]


def blink_shapes(blinks: Sequence[BlinkEvent]) -> Floats:
    """Return (n, 4) closing, shut and opening in ms, and fastest closing over fastest opening."""
    rows = [
        (1e3 * b.close_s, 1e3 * b.hold_s, 1e3 * b.open_s, b.close_peak_1_s / b.open_peak_1_s)
        for b in blinks
    ]
    return np.array(rows).reshape(-1, 4)


def evoked_blinks(run: GazeTrace) -> Floats:
    """Return (n, 2) amplitude of each saccade in deg and whether a blink accompanied it.

    Shifts during an earlier blink are omitted, because shut eyes cannot blink.
    """
    onsets = np.array([blink.onset_s for blink in run.blinks])
    opened = onsets + np.array([blink.duration_s for blink in run.blinks])
    rows = []
    for saccade in run.saccades:
        since = onsets - saccade.onset_s
        if ((since <= -_WITH_BEFORE_S) & (opened + _AGAIN_S > saccade.onset_s)).any():
            continue
        near = ((since > -_WITH_BEFORE_S) & (since < _WITH_AFTER_S)).any()
        asked = saccade.commanded.amplitude_deg if saccade.commanded is not None else nan
        if not np.isnan(asked):
            rows.append((max(asked, saccade.amplitude_deg), float(near)))
    return np.array(rows).reshape(-1, 2)


def saccade_blinks(run: GazeTrace) -> Floats:
    """Return (n,) whether each blink begins together with a saccade."""
    onsets = np.array([saccade.onset_s for saccade in run.saccades])
    if not len(onsets):
        return np.zeros(len(run.blinks))
    apart = [np.abs(onsets - blink.onset_s).min() for blink in run.blinks]
    return (np.array(apart) <= _TIED_S).astype(float)


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of lids."""
    seen, asked = blink_shapes(run.blinks), blink_shapes(run.asked_blinks)
    large = evoked_blinks(run)
    large = large[large[:, 0] >= _EVOKING_DEG]
    partial = np.array([float(blink.depth < _SHUT) for blink in run.blinks])
    shape = [
        MeasuredValue(key, seen[:, column], median, measured_value(median, asked[:, column]))
        for column, key in enumerate(("blink_close", "blink_hold", "blink_open", "blink_ratio"))
    ]
    asked_rate = 60.0 * len(run.asked_blinks) / run.seconds if run.seconds else nan
    return [
        MeasuredValue("blink_rate", _counts(run), _per_minute, asked_rate, len(run.blinks)),
        MeasuredValue("blink_rate_talk", _counts(run), _per_minute, asked_rate, len(run.blinks)),
        MeasuredValue("blink_cv", blink_intervals(run), spread_over_mean),
        *shape,
        MeasuredValue("evoked", large[:, 1], mean),
        MeasuredValue("blink_partial", partial, mean),
        MeasuredValue("blink_tied", saccade_blinks(run), mean),
    ]


def _counts(run: GazeTrace) -> Floats:
    """Return (n, 2) blinks and seconds in each ten seconds of the run."""
    if not len(run.rows):
        return np.zeros((0, 2))
    first, last = run.column("t")[[0, -1]]
    edges = np.append(np.arange(first, last, _PART_S), last)
    seen, _ = np.histogram([blink.onset_s for blink in run.blinks], bins=edges)
    return np.column_stack([seen, np.diff(edges)])


def _per_minute(rows: Floats) -> float:
    return float(60.0 * rows[:, 0].sum() / rows[:, 1].sum())

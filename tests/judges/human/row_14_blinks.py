"""Blinks: at the published rates, about the onset of gaze shifts, half of them incomplete.

People blink 17 times a minute at rest and 26 times in conversation (Bentivoglio 1997), gaze-evoked
blinks included; those begin with eyes and head, not in one tick with them (Evinger 1994). Bands of
the rates: three standard deviations of a count in three minutes. Half of all blinks are incomplete
(Ousler et al. 2014).
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs

_FULL = 0.95
_SMALL_DEG = (2.0, 4.5)
_NEAR_S = 0.1
_LEAST_S = 180.0
"""Of all runs together: the bands of the rates are those of a count in three minutes."""

WANTED = {
    "at rest, 1/min": (12.0, 21.0),
    "in conversation, 1/min": (20.0, 32.0),
    "in the tick of a saccade, %": (0.0, 5.0),
    "begin within 100 ms of a saccade of 2-4.5 deg, over chance": (0.0, 1.5),
    "incomplete, %": (35.0, 65.0),
}


def measure(runs: Runs) -> Figures:
    """Return the figures of a still person (at rest) and of a talking one."""
    least_s = _LEAST_S / len(runs.seeds)
    rest = runs("visitor", least_s)
    talk = runs("face-to-face", least_s, conversation="listen")
    every = [*rest, *talk]
    onsets = [onset for one in every for onset in _planned(one.blinks)]
    together = sum(
        len(np.intersect1d(_planned(one.blinks), _planned(one.saccades))) for one in every
    )
    depths = np.array([blink.depth for one in every for blink in one.trace.blinks])
    return {
        "at rest, 1/min": _per_min(rest),
        "in conversation, 1/min": _per_min(talk),
        "in the tick of a saccade, %": 100.0 * together / max(1, len(onsets)),
        "begin within 100 ms of a saccade of 2-4.5 deg, over chance": _with_small(every),
        "incomplete, %": 100.0 * (depths < _FULL).mean(),
    }


def _planned(counts: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.diff(counts) > 0) + 1


def _per_min(runs: Sequence[MeasuredRun]) -> float:
    seen = sum(len(one.trace.blinks) for one in runs)
    return 60.0 * seen / sum(one.trace.seconds for one in runs)


def _with_small(runs: Sequence[MeasuredRun]) -> float:
    """Return how much more often blinks begin after small saccades than at other times."""
    after, covered, blinks, whole = 0, 0.0, 0, 0.0
    for one in runs:
        onsets = np.array([blink.onset_s for blink in one.trace.blinks])
        starts = np.array(
            [
                s.onset_s
                for s in one.trace.saccades
                if _SMALL_DEG[0] <= s.amplitude_deg <= _SMALL_DEG[1]
            ]
        )
        since = onsets[:, None] - starts[None, :]
        after += int(((since >= 0.0) & (since < _NEAR_S)).any(axis=1).sum())
        covered += _NEAR_S * len(starts)
        blinks, whole = blinks + len(onsets), whole + one.trace.seconds
    return (after / covered) / (blinks / whole) if covered and blinks else float("nan")

"""A waving hand gets a glance, a sinking hand none, and the face gets the time.

The visitor waves 1.5 times a second by +-9.4 deg, for 3.5 s in each round of 44 s. People look at
what begins to move, and back at the face: repeated motion is soon known (Neo & Chua 2006).
"""

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs

WANTED = {
    "waves that get a glance, %": (70.0, 100.0),
    "longest look at a waving hand, s": (0.3, 1.6),
    "wave after 1.5 s on the hand, %": (0.0, 10.0),
    "targets that are a sinking hand, %": (0.0, 5.0),
    "visitor, hands with a face in view, %": (0.0, 8.0),
}

WAVE_S = (17.5, 21.0)
_ROUND_S, _SINKS_S = 44.0, 0.5
_KNOWN_S = 1.5


def measure(runs: Runs) -> Figures:
    """Return glances, looks and shares of the time over all seeds."""
    looks, late, sinking, hands, faces = [], [], [], 0, 0
    for seen in runs("visitor", least_s=22.0):
        on = np.char.startswith(seen.target_name.astype(str), "hand")
        for start_s in np.arange(WAVE_S[0], seen.t_s[-1] - 4.0, _ROUND_S):
            end_s = start_s + WAVE_S[1] - WAVE_S[0]
            looks.append(_longest_s(seen, on, start_s, end_s + 1.0))
            late.append(_share(seen, on, start_s + _KNOWN_S, end_s - _SINKS_S))
            sinking.append(_share(seen, on, end_s - 0.5 * _SINKS_S, end_s + 0.3))
        hands += int(on.sum())
        faces += int((seen.part != "").sum())
    return {
        "waves that get a glance, %": 100.0 * (np.array(looks) > 0.1).mean(),
        "longest look at a waving hand, s": max(looks),
        "wave after 1.5 s on the hand, %": 100.0 * np.mean(late),
        "targets that are a sinking hand, %": 100.0 * np.mean(sinking),
        "visitor, hands with a face in view, %": 100.0 * hands / max(1, hands + faces),
    }


def _share(seen: MeasuredRun, on: np.ndarray, start_s: float, end_s: float) -> float:
    return on[(seen.t_s > start_s) & (seen.t_s < end_s)].mean()


def _longest_s(seen: MeasuredRun, on: np.ndarray, start_s: float, end_s: float) -> float:
    """Return the longest uninterrupted time on the hand."""
    there = on & (seen.t_s > start_s) & (seen.t_s < end_s)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], there.astype(int), [0]))))
    lengths = (edges[1::2] - edges[::2]) * seen.period_s
    return lengths.max(initial=0.0)

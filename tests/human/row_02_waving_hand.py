"""The visitor's waving hand is predicted after two cycles, and the head does not wag with it.

1.5 waves a second of +-9.4 deg, for 3.5 s in each round of 44 s: nothing that smooth pursuit can
follow in full, whose limit is 63 deg/s.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import MeasuredRun, Runner

WANTED = {
    "distance of gaze and hand, rms, deg": (0.0, 3.0),
    "saccades on the hand, 1/s": (0.0, 2.5),
    "head at the frequency of the wave, deg": (0.0, 1.0),
}

WAVE_HZ = 1.5
_ROUND_S, _WAVE_S = 44.0, (17.5, 20.6)
_CYCLES = 2.0


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return distance, saccades and motion of the head while the hand is the target."""
    known: list[tuple[float, ...]] = []
    whole: list[tuple[float, ...]] = []
    for seed in seeds:
        seen = run("visitor", seed=seed, seconds=max(seconds, 22.0))
        for start_s in np.arange(_WAVE_S[0], seen.t_s[-1] - 3.0, _ROUND_S):
            end_s = start_s + _WAVE_S[1] - _WAVE_S[0]
            whole.append(_waved(seen, start_s, end_s))
            known.append(_waved(seen, start_s + _CYCLES / WAVE_HZ, end_s))
    after, all_of_it = (np.array([row for row in rows if row]) for rows in (known, whole))
    return {
        "distance of gaze and hand, rms, deg": _rms(after[:, 0], after[:, 1]),
        "saccades on the hand, 1/s": float(after[:, 2].sum() / after[:, 1].sum()),
        "head at the frequency of the wave, deg": float(after[:, 3].max()),
        "distance, first cycles too, deg": _rms(all_of_it[:, 0], all_of_it[:, 1]),
        "saccades, first cycles too, 1/s": float(all_of_it[:, 2].sum() / all_of_it[:, 1].sum()),
        "head, first cycles too, deg": float(all_of_it[:, 3].max()),
        "share of the wave on the hand, %": 100.0
        * float(all_of_it[:, 1].sum() / ((_WAVE_S[1] - _WAVE_S[0]) * len(whole))),
    }


def _waved(seen: MeasuredRun, start_s: float, end_s: float) -> tuple[float, ...]:
    """Return sum of squares, seconds, saccades, and the head's amplitude; empty if never on it."""
    on = (seen.t_s > start_s) & (seen.t_s < end_s)
    on &= np.char.startswith(seen.target_name.astype(str), "hand")
    if on.sum() < 20:
        return ()
    dt = float(np.median(np.diff(seen.t_s)))
    off = np.hypot(*(seen.gaze_deg - seen.truth_deg("hand 0"))[on].T)
    begun = np.diff(seen.saccades, prepend=seen.saccades[0])[on].sum()
    t, head = seen.t_s[on], seen.head_deg[on, 0]
    w = 2.0 * np.pi * WAVE_HZ
    base = np.column_stack(
        [np.ones_like(t), t - t[0], (t - t[0]) ** 2, np.sin(w * t), np.cos(w * t)]
    )
    fit = np.linalg.lstsq(base, head, rcond=None)[0]
    return float((off**2).sum() * dt), on.sum() * dt, float(begun), float(np.hypot(fit[3], fit[4]))


def _rms(squares: np.ndarray, seconds: np.ndarray) -> float:
    return float(np.sqrt(squares.sum() / seconds.sum()))

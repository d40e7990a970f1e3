"""After a saccade, nothing comes sooner than 100 ms: the planned saccades of the shipped scenes."""

import numpy as np
from human.measured_run import Figures, Runs

SCENES = ("visitor", "face-to-face")
WANTED = {"shortest pause after a landing, ms": (95.0, 1e6)}


def pauses_ms(flight: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """Return the times from each landing to the next saccade."""
    begins = np.flatnonzero(flight[1:] & ~flight[:-1]) + 1
    ends = np.flatnonzero(~flight[1:] & flight[:-1]) + 1
    following = np.searchsorted(begins, ends, side="left")
    known = following < len(begins)
    return 1e3 * (t_s[begins[following[known]]] - t_s[ends[known]])


def measure(runs: Runs) -> Figures:
    """Return the figure over all seeds."""
    every = [one for scene in SCENES for one in runs(scene)]
    pauses = np.concatenate([pauses_ms(one.phase == "saccade", one.t_s) for one in every])
    return {"shortest pause after a landing, ms": pauses.min()}

"""After a saccade, nothing comes sooner than 100 ms: the planned saccades of the shipped scenes."""

from collections.abc import Sequence

import numpy as np
from human.measured_run import Runner

SCENES = ("visitor", "face-to-face")
WANTED = {"shortest pause after a landing, ms": (95.0, 1e6)}


def pauses_ms(flight: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """Return the times from each landing to the next saccade."""
    begins = np.flatnonzero(flight[1:] & ~flight[:-1]) + 1
    ends = np.flatnonzero(~flight[1:] & flight[:-1]) + 1
    following = np.searchsorted(begins, ends, side="left")
    known = following < len(begins)
    return 1e3 * (t_s[begins[following[known]]] - t_s[ends[known]])


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figure over all seeds."""
    runs = [run(scene, seed=n, seconds=seconds) for scene in SCENES for n in seeds]
    pauses = np.concatenate([pauses_ms(one.phase == "saccade", one.t_s) for one in runs])
    return {"shortest pause after a landing, ms": float(pauses.min())}

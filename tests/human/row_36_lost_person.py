"""After a person has left: a search in small steps that the head completes.

The scene ``visitor``, from the loss until the person is seen again. People search in shifts of 10
to 20 deg, and turn the head with the eyes.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import MeasuredRun, Runner

SCENE = "visitor"
_EYE_LIMIT_DEG = 33.0
_LOOKS = ("search", "glance", "rest")

WANTED = {
    "largest shift, deg": (5.0, 35.0),
    "steps of the search, median, deg": (8.0, 20.0),
    "steps of the search from 10 to 20 deg, %": (60.0, 100.0),
    "longest time with an eye at its limit, s": (0.0, 0.4),
    "eyes off straight ahead at the end of a look of the search, median, deg": (0.0, 10.0),
}


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    steps, every, limit_s, ends = [], [], [], []
    for seed in seeds:
        one = run(SCENE, seed=seed, seconds=seconds)
        kinds = np.array([name.split()[0] for name in one.target_name])
        starts = np.flatnonzero(np.diff(one.shift)) + 1
        for k in starts:
            if kinds[k] not in _LOOKS:
                continue
            size = float(np.linalg.norm(one.target_deg[k] - one.target_deg[k - 1]))
            every.append(size)
            if kinds[k] == "search":
                steps.append(size)
            if kinds[k - 1] == "search":
                ends.append(float(abs(one.target_deg[k - 1, 0] - one.head_deg[k - 1, 0])))
        away = np.isin(kinds, _LOOKS) | ~_in_front(one)
        limit_s.append(
            _longest(one, away & (np.abs(one.eyes_deg[..., 0]).max(axis=1) > _EYE_LIMIT_DEG))
        )
    found = np.array(steps)
    return {
        "largest shift, deg": max(every),
        "steps of the search, median, deg": float(np.median(found)),
        "steps of the search from 10 to 20 deg, %": 100.0
        * float(((found >= 9.0) & (found <= 21.0)).mean()),
        "longest time with an eye at its limit, s": max(limit_s),
        "eyes off straight ahead at the end of a look of the search, median, deg": float(
            np.median(ends)
        ),
    }


def _in_front(one: MeasuredRun) -> np.ndarray:
    return np.asarray(one.truth["face 0"][:, 0] > 0.3)


def _longest(one: MeasuredRun, held: np.ndarray) -> float:
    """Return the longest time for which something held without a break."""
    edges = np.flatnonzero(np.diff(held.astype(int), prepend=0, append=0))
    lasts = [
        one.t_s[min(b, len(held) - 1)] - one.t_s[a]
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
    return float(max(lasts, default=0.0))

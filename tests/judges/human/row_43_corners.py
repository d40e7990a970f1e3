"""Eyes seldom stay in the corners: beyond 15 deg in the head, the head comes along.

People turn the head for what they go on looking at; the eyes are rarely more than 15 deg from its
axis (Stahl 1999). All of the time counts, from the first tick, also with a speaker out of view.
"""

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs
from human.spells import spells

SCENES = {
    "one person": ("visitor", "interview"),
    "two people": ("two-people", "table"),
    "three people": ("three-people",),
}
WANTED = {f"{who}, beyond 15 deg, % of the time": (0.0, 10.0) for who in SCENES}

_CORNER_DEG, _LONGEST_S = 15.0, 128.0


def measure(runs: Runs) -> Figures:
    """Return shares over all seeds, and the longest time without a break."""
    figures: Figures = {}
    for who, scenes in SCENES.items():
        off = [one for scene in scenes for one in runs(scene, most_s=_LONGEST_S)]
        figures[f"{who}, beyond 15 deg, % of the time"] = (
            100.0 * np.concatenate([aside(one) for one in off]).mean()
        )
        figures[f"{who}, longest unbroken time, s"] = max(
            (one.t_s[end - 1] - one.t_s[begin])
            for one in off
            for begin, end in spells(aside(one)) or [(0, 1)]
        )
    return figures


def aside(one: MeasuredRun) -> np.ndarray:
    """Return (n,) whether the eyes are in a corner."""
    return np.asarray(np.hypot(*one.eyes_deg.T) > _CORNER_DEG)

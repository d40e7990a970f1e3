"""Ten minutes with one person: how the looks at the face and away from it change.

No band: how much people grow used to a face at this distance has not been measured.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import Runner
from human.row_03_rests import SCENE
from human.row_45_talk import averted, lasting

WANTED: dict[str, tuple[float, float]] = {}

_TIMES_S = {"minutes 1 to 2": (0.0, 120.0), "minutes 9 to 10": (480.0, 600.0)}


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures of the first seed; a shorter time is divided in the same way."""
    one = run(SCENE, seed=seeds[0], seconds=2.0 * seconds)
    figures: dict[str, float] = {}
    for name, times_s in _TIMES_S.items():
        ticks = slice(*np.searchsorted(one.t_s, np.multiply(times_s, 2.0 * seconds / 600.0)))
        away = averted(one)[ticks]
        looks = lasting(one, away, 0.15)
        figures[f"{name}: on the face, % of the time"] = 100.0 * float(1.0 - away.mean())
        figures[f"{name}: looks away a minute"] = 60.0 * len(looks) / float(np.ptp(one.t_s[ticks]))
    return figures

"""Independent judges find the saccades the robot commanded in its export, and hardly any other.

All the time is judged. Findings within a blink of the export are the blink's own
motion of the eyes.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import Runner
from human.saccade_judges import JUDGES, exported, marks

SCENES = ("visitor", "face-to-face")

WANTED = {
    f"{scene}, {judge}: {what}": band
    for scene in SCENES
    for judge in JUDGES
    for what, band in (("found, %", (95.0, 100.0)), ("not ours, %", (0.0, 3.0)))
}


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return found and not ours of each scene and judge, over all seeds, in percent."""
    out = {}
    for scene in SCENES:
        runs = [exported(run(scene, seed=seed, seconds=seconds)) for seed in seeds]
        for name, judge in JUDGES.items():
            seen = [judge(one) for one in runs]
            pairs = list(zip(runs, seen, strict=True))
            all_of_it = [marks(*pair, True) for pair in pairs]
            out[f"{scene}, {name}: found, %"] = _percent([mark.ours for mark in all_of_it])
            out[f"{scene}, {name}: not ours, %"] = _percent([~mark.theirs for mark in all_of_it])
    return out


def _percent(true: list[np.ndarray]) -> float:
    every = np.concatenate(true)
    return 100.0 * float(every.mean()) if len(every) else float("nan")

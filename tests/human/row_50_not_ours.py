"""What an independent judge takes for saccades are ours: everything else of the motion is smooth.

pymovements (Engbert & Kliegl) on the export of the shipped scene, all of its time, with what is
followed fast and the first seconds. Smooth motion above its threshold looks like saccades, and a
bystander takes it for these.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import Runner
from human.saccade_judges import exported, marks, pymovements_saccades

WANTED = {
    "the judge's saccades that are not ours, %": (0.0, 3.0),
    "our saccades that the judge finds, %": (95.0, 100.0),
}


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    files = [exported(run("visitor", seed=seed, seconds=seconds)) for seed in seeds]
    found = [marks(file, pymovements_saccades(file)) for file in files]
    ours, theirs = map(np.concatenate, zip(*found, strict=True))
    return {
        "the judge's saccades that are not ours, %": 100.0 * float((~theirs).mean()),
        "our saccades that the judge finds, %": 100.0 * float(ours.mean()),
    }

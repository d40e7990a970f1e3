"""What an independent judge takes for saccades are ours: everything else of the motion is smooth.

pymovements (Engbert & Kliegl) on the export of the shipped scene, all of its time, with what is
followed fast and the first seconds. Smooth motion above its threshold looks like saccades, and a
bystander takes it for these.
"""

import numpy as np
from human.measured_run import Figures, Runs
from human.saccade_judges import exported, marks, pymovements_saccades

WANTED = {
    "the judge's saccades that are not ours, %": (0.0, 3.0),
    "our saccades that the judge finds, %": (95.0, 100.0),
}


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    files = [exported(one) for one in runs("visitor")]
    found = [marks(file, pymovements_saccades(file)) for file in files]
    ours, theirs = map(np.concatenate, zip(*found, strict=True))
    return {
        "the judge's saccades that are not ours, %": 100.0 * (~theirs).mean(),
        "our saccades that the judge finds, %": 100.0 * ours.mean(),
    }

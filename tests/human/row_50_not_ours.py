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
_NONE = np.empty((0, 2))


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    files = [exported(run("visitor", seed=seed, seconds=seconds)) for seed in seeds]
    seen = [pymovements_saccades(file) for file in files]
    ours, theirs = (np.concatenate(each) for each in zip(*map(marks, files, seen), strict=True))
    lids = [
        marks(file._replace(blinks=_NONE), each) for file, each in zip(files, seen, strict=True)
    ]
    return {
        "the judge's saccades that are not ours, %": 100.0 * float((~theirs).mean()),
        "the same, with the eyes' motion of blinks, %": 100.0
        * float((~np.concatenate([each.theirs for each in lids])).mean()),
        "our saccades that the judge finds, %": 100.0 * float(ours.mean()),
    }

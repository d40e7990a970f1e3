"""What independent judges take for saccades are ours: everything else of the motion is smooth.

pymovements (Engbert & Kliegl) on the export of the shipped scene, all of its time, with what is
followed fast and the first seconds. Smooth motion above its threshold looks like saccades, and a
bystander takes it for these. REMoDNaV (Dar, Wagner & Hanke 2021) on a talk face to face.
"""

import numpy as np
from human.measured_run import Figures, Runs
from human.saccade_judges import exported, marks, pymovements_saccades, remodnav_saccades

JUDGES = {
    "pymovements": ("visitor", pymovements_saccades),
    "REMoDNaV": ("face-to-face", remodnav_saccades),
}
WANTED = {
    f"{name}: {figure}": band
    for name in JUDGES
    for figure, band in (
        ("saccades that are not ours, %", (0.0, 3.0)),
        ("our saccades that it finds, %", (95.0, 100.0)),
    )
}


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    figures = {}
    for name, (scene, judge) in JUDGES.items():
        files = [exported(one) for one in runs(scene)]
        found = [marks(file, judge(file)) for file in files]
        ours, theirs = map(np.concatenate, zip(*found, strict=True))
        figures[f"{name}: saccades that are not ours, %"] = 100.0 * (~theirs).mean()
        figures[f"{name}: our saccades that it finds, %"] = 100.0 * ours.mean()
    return figures

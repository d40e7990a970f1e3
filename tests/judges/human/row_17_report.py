"""The report of the default profile has at most two measures outside, in either scene.

A measure with too few events is neither inside nor outside; nor is one that is outside by no more
than chance may have done.
"""

import pytest
from human.measured_run import Figures, Runs

pytest.importorskip("gazerig.features.lab")  # its measures

from gazerig.features.lab.report.measures import judge_run  # noqa: E402

SCENES = ("visitor", "face-to-face")
WANTED = {f"{scene}, outside, most of all seeds": (0.0, 2.0) for scene in SCENES}


def measure(runs: Runs) -> Figures:
    """Return how many measures are outside."""
    figures: Figures = {}
    for scene in SCENES:
        judged = [judge_run(one.trace) for one in runs(scene)]
        outside = [sum(one.verdict == "outside" for one in measures) for measures in judged]
        figures[f"{scene}, outside, most of all seeds"] = max(outside)
    return figures

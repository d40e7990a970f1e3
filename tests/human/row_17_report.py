"""The report of the default profile has at most two measures outside, in either scene.

A measure with too few events is neither inside nor outside; nor is one that is outside by no more
than chance may have done.
"""

from collections.abc import Callable, Sequence

import pytest
from human.measured_run import MeasuredRun

pytest.importorskip("gazerig.features.lab")  # its measures

from gazerig.features.lab.report.measures import judge_run  # noqa: E402

SCENES = ("visitor", "face-to-face")
WANTED = {f"{scene}, outside, most of all seeds": (0.0, 2.0) for scene in SCENES}


def measure(
    run: Callable[..., MeasuredRun], seconds: float, seeds: Sequence[int]
) -> dict[str, float]:
    """Return how many measures are outside."""
    figures: dict[str, float] = {}
    for scene in SCENES:
        runs = [judge_run(run(scene, seed=seed, seconds=seconds).trace) for seed in seeds]
        outside = [sum(one.verdict == "outside" for one in measures) for measures in runs]
        figures[f"{scene}, outside, most of all seeds"] = max(outside)
    return figures

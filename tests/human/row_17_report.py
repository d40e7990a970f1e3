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
    """Return how many measures are outside, and in how many runs each of them is."""
    figures: dict[str, float] = {}
    for scene in SCENES:
        verdicts: dict[str, list[float]] = {"outside": [], "uncertain": [], "pass": []}
        for seed in seeds:
            measures = judge_run(run(scene, seed=seed, seconds=seconds).trace)
            for verdict, counts in verdicts.items():
                counts.append(sum(one.verdict == verdict for one in measures))
            for one in measures:
                if one.verdict in ("outside", "uncertain"):
                    name = f"{scene}, runs with {one.band.key} {one.verdict}"
                    figures[name] = figures.get(name, 0.0) + 1.0
        figures[f"{scene}, outside, most of all seeds"] = max(verdicts["outside"])
        figures[f"{scene}, uncertain, most of all seeds"] = max(verdicts["uncertain"])
        figures[f"{scene}, inside, fewest of all seeds"] = min(verdicts["pass"])
    return figures

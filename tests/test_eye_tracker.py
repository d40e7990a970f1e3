"""The exported file of a run with motors before independent judges, as a laboratory would use them.

The shipped scene, the default profile and byte-true emulated servos; the CSV that `gazerig export`
writes; pymovements (Engbert & Kliegl) and REMoDNaV (Dar, Wagner & Hanke 2021) find its saccades.
"""

import numpy as np
import pytest
from human.measured_run import measured_run
from human.row_07_judges import measure
from human.saccade_judges import JUDGES, Exported, exported, marks

SECONDS = 24.0


@pytest.fixture(scope="module")
def run() -> Exported:
    return exported(measured_run("face-to-face", seconds=SECONDS))


@pytest.mark.parametrize("name", JUDGES)
def test_e67_a_judge_finds_our_saccades_and_hardly_any_other(name: str, run: Exported) -> None:
    pytest.importorskip(name, reason=f"{name} is not installed: pip install -e '.[dev]'")
    assert len(run.commanded) > 40
    seen = JUDGES[name](run)
    mark = marks(run, seen)
    assert mark.ours.mean() >= 0.95
    assert np.mean(~mark.theirs) <= 0.03
    # And it is these saccades that agree, not any: of half as many commanded, half are not ours.
    fewer = run._replace(commanded=run.commanded[::2])
    assert 0.3 < np.mean(~marks(fewer, seen).theirs) < 0.7
    # A rest in which nothing was commanded is none of ours either.
    later = run._replace(commanded=run.commanded + 0.15)
    assert marks(later, seen).ours.mean() < 0.75
    assert run.fast.mean() < 0.1


def test_a_saccade_that_nobody_commanded_is_not_ours(run: Exported) -> None:
    pytest.importorskip("pymovements")
    gap = np.argmax(np.diff(run.commanded[:, 0]))
    middle = 0.5 * (run.commanded[gap, 1] + run.commanded[gap + 1, 0])
    thrown = np.clip((run.time_s - middle) / 0.03, 0.0, 1.0)[:, None] * np.array([3.0, 0.0])
    judge = JUDGES["pymovements"]
    before, after = (
        marks(one, judge(one)) for one in (run, run._replace(gaze_deg=run.gaze_deg + thrown))
    )
    assert np.sum(~after.theirs) == np.sum(~before.theirs) + 1


def test_the_row_counts_all_seeds_and_both_scenes() -> None:
    pytest.importorskip("pymovements")
    pytest.importorskip("remodnav")
    still = measured_run("face-to-face", seconds=SECONDS)

    def runner(scene: object, **_: object) -> object:
        return still

    found = measure(runner, SECONDS, (0,))  # type: ignore[arg-type]
    assert found["visitor, remodnav: found, %"] == found["face-to-face, remodnav: found, %"]
    assert all(0.0 <= value <= 100.0 for value in found.values())

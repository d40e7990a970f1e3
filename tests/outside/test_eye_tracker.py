"""The exported file of a run with motors before independent judges, as a laboratory would use them.

The shipped scene, the default profile and byte-true emulated servos; the CSV that `gazerig export`
writes; pymovements (Engbert & Kliegl) and REMoDNaV (Dar, Wagner & Hanke 2021) find its saccades.
"""

import numpy as np
import pytest
from human.measured_run import measured_run
from human.saccade_judges import JUDGES, Exported, exported, marks

SECONDS = 24.0


@pytest.fixture(scope="module")
def run() -> Exported:
    return exported(measured_run("face-to-face", seconds=SECONDS))


@pytest.mark.parametrize("name", JUDGES)
def test_e67_a_judge_finds_our_saccades_and_hardly_any_other(name: str, run: Exported):
    pytest.importorskip(name, reason=f"{name} is not installed: pip install -e '.[dev]'")
    assert len(run.commanded) > 40
    mark = marks(run, JUDGES[name](run))
    assert mark.ours.mean() >= 0.95
    assert np.mean(~mark.theirs) <= 0.03

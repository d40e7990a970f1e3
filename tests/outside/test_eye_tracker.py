"""The exported file of a run with motors before an independent judge, as a laboratory would use it.

The shipped scene, the default profile and byte-true emulated servos; the CSV that `gazerig export`
writes; REMoDNaV (Dar, Wagner & Hanke 2021) finds its saccades. `make judge` asks pymovements.
"""

import numpy as np
import pytest
from human.measured_run import measured_run
from human.saccade_judges import exported, marks, remodnav_saccades


def test_e67_a_judge_finds_our_saccades_and_hardly_any_other():
    pytest.importorskip("remodnav", reason="remodnav is not installed: pip install -e '.[dev]'")
    run = exported(measured_run("face-to-face", seconds=20.0))
    assert len(run.commanded) > 40
    mark = marks(run, remodnav_saccades(run))
    assert mark.ours.mean() >= 0.95
    assert np.mean(~mark.theirs) <= 0.03

"""Rows 1 and 2 of tests/human in a short form: a swinging face, a waving hand."""

import numpy as np
import pytest
from human import row_01_pursuit, row_02_waving_hand
from human.measured_run import half_rate_run, measured_run
from human.row_01_pursuit import ON_ONE_POINT, following


@pytest.mark.parametrize(
    ("hz", "band"),
    [(0.5, "gain at .5 Hz"), (1.0, "gain at 1 Hz"), (1.5, "largest gain, .1 to 2 Hz")],
)
def test_e61_a_swinging_face_is_followed_with_the_gain_of_people(hz: float, band: str) -> None:
    byte_true = hz == 1.0  # once with the delay of real servos, in the middle of the frequencies
    seen = following(measured_run if byte_true else half_rate_run, hz, 14.0, 0)
    low, high = row_01_pursuit.WANTED[band]
    assert max(low, 0.85) <= seen.gain <= high
    assert abs(seen.phase_deg) < 12.0
    assert seen.fastest_deg_s <= row_01_pursuit.WANTED["fastest smooth gaze, deg/s"][1]


def test_e62_a_waving_hand_gets_a_glance_and_no_more() -> None:
    seen = half_rate_run("visitor", seconds=23.0)
    on = np.char.startswith(seen.target_name.astype(str), "hand")
    assert 0.2 < on.sum() * 0.01 < 1.6
    assert seen.t_s[on].max() < row_02_waving_hand.WAVE_S[0] + 2.0
    assert (seen.part[seen.t_s > 20.0] != "").mean() > 0.5


def test_without_the_prediction_the_gaze_is_late() -> None:
    linear = {**ON_ONE_POINT, "gaze.oculomotor.target_prediction": "velocity"}
    assert following(half_rate_run, 1.0, 14.0, 0, linear).phase_deg < -20.0

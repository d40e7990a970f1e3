"""Lower lids: they go with the gaze and meet the upper ones in a blink."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from gazerig.gaze.lids.blink import LidParams
from gazerig.gaze.lids.lids import LidOpenings, Lids
from gazerig.gaze.types import GazeCommand
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

DT = 0.005
AWAKE = 0.8
SHUT_S = 0.085  # after the onset: between close_ms and close_ms + hold_ms


def lids(**params: float | str) -> Lids:
    """Return lids that do not blink by themselves."""
    chosen = LidParams(**{"blinks_per_min": 0.0, **params})  # type: ignore[arg-type]
    return Lids(chosen, np.random.default_rng(0))


def winked(model: Lids, t_s: float, pitch_deg: float = 0.0) -> LidOpenings:
    """Shut both eyes by winks at a time and give the openings while they are shut."""
    model.step(t_s, radians(pitch_deg), None)
    model.wink("left", t_s)
    model.wink("right", t_s)
    return model.step(t_s + SHUT_S, radians(pitch_deg), None)


def test_lower_lids_follow_by_less_than_the_upper_ones_and_evenly() -> None:
    model = lids()
    level, up, down = (model.step(0.0, radians(a), None) for a in (0.0, 10.0, -10.0))
    assert level.lower_left == level.lower_right == AWAKE
    assert up.lower_left == pytest.approx(AWAKE - 0.08)
    assert down.lower_left == pytest.approx(AWAKE + 0.08)
    # On lids that travel 45 and 30 deg: a quarter of the upper lid's travel.
    way = 30.0 * (down.lower_left - level.lower_left) / (45.0 * (level.left - down.left))
    assert way == pytest.approx(2.2 / 9.1, abs=0.01)
    # Looking down narrows the fissure, looking up a little does not.
    assert 45.0 * down.left + 30.0 * down.lower_left < 45.0 * level.left + 30.0 * level.lower_left
    assert 45.0 * up.left + 30.0 * up.lower_left > 45.0 * level.left + 30.0 * level.lower_left
    assert model.step(0.0, radians(-80.0), None).lower_left == 1.0
    still = lids(law="nakamoto").step(0.0, radians(-30.0), None)
    assert (still.left, still.lower_left) == (0.75, AWAKE)


@pytest.mark.parametrize("pitch_deg", [-60.0, -10.0, 0.0, 30.0])
def test_upper_and_lower_lids_meet_wherever_the_eye_looks(pitch_deg: float) -> None:
    shut = winked(lids(), 1.0, pitch_deg)
    assert (shut.left, shut.right, shut.lower_left, shut.lower_right) == (0.0,) * 4


def test_an_incomplete_blink_stops_both_lids_at_the_same_share() -> None:
    model = lids(blinks_per_min=40.0)
    rows = np.array([model.step(k * DT, 0.0, None) for k in range(round(60.0 / DT))])
    assert rows[:, 3] / AWAKE == pytest.approx(rows[:, 0] / 0.75)
    assert rows[:, 4] / AWAKE == pytest.approx(rows[:, 1] / 0.75)


def test_lids_that_meet_have_their_joints_at_the_calibrated_ends() -> None:
    ends = {
        "left_upper_lid": (radians(-20.0), radians(25.0)),
        "right_upper_lid": (radians(-22.0), radians(24.0)),
        "left_lower_lid": (radians(-8.0), radians(22.0)),
        "right_lower_lid": (radians(-9.0), radians(21.0)),
    }
    kinematics = Kinematics(GeometryParams(0.0, 0.0, 0.0), ends, ends)
    shut, level = winked(lids(), 1.0, -25.0), lids().step(0.0, 0.0, None)

    def joints(openings: LidOpenings) -> dict[str, float]:
        left, right, blink, lower_left, lower_right = openings
        command = GazeCommand(
            (0.0, 0.0, 0.0), (0.0, 0.0), (0.0, 0.0), left, right, "fixate", blink,
            (1.0, 0.0, 0.0), 0, 0, 0, lower_left, lower_right,
        )  # fmt: skip
        return dict(zip(kinematics.names, kinematics.inverse(command), strict=True))

    assert joints(shut) == pytest.approx({name: shut for name, (shut, _) in ends.items()})
    assert joints(level)["right_upper_lid"] == pytest.approx(radians(-22.0 + 0.75 * 46.0))
    assert joints(level)["right_lower_lid"] == pytest.approx(radians(-9.0 + 0.8 * 30.0))


def test_lids_glide_to_what_they_are_retuned_to() -> None:
    model = lids()
    before = model.step(1.0, radians(-20.0), None)
    model.retune(LidParams(blinks_per_min=0.0, rest_opening=0.3, law="nakamoto"))
    assert model.step(1.0, radians(-20.0), None) == before
    trace = [before, *(model.step(1.0 + k * DT, radians(-20.0), None) for k in range(70))]
    assert np.abs(np.diff(np.array(trace), axis=0)).max() <= 1.875 * 0.5 * DT / 0.3 + 1e-9
    assert trace[-1][0] == pytest.approx(0.3) and trace[-1][3] == pytest.approx(AWAKE)


def test_a_wink_that_is_over_does_not_come_back_when_blinks_are_made_longer() -> None:
    model = lids()
    winked(model, 1.0)
    model.step(1.6, 0.0, None)
    model.retune(LidParams(blinks_per_min=0.0, close_ms=500.0, hold_ms=1000.0, open_ms=1500.0))
    for k in range(1, 400):
        assert model.step(1.6 + k * DT, 0.0, None) == (0.75, 0.75, False, AWAKE, AWAKE)


def test_a_higher_rate_begins_no_blink_within_a_blink() -> None:
    slow = LidParams(0.0, 500.0, 1000.0, 1500.0, law="nakamoto")
    model = Lids(slow, np.random.default_rng(0))
    assert not model.step(0.0, 0.0, radians(90.0)).blink and model.blinks == 1
    assert model.step(0.6, 0.0, None).lower_left == 0.0
    model.retune(replace(slow, blinks_per_min=60.0))
    trace = [model.step(0.6 + k * DT, 0.0, None)[3] for k in range(round(2.39 / DT))]
    assert np.abs(np.diff(trace)).max() <= 2.2 / 1.5 * DT and model.blinks == 1
    assert model.step(3.02, 0.0, None) and model.blinks == 2

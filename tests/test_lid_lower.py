"""Lower lids: they go with the gaze, meet the upper ones in a blink, hardly show sleepiness."""

from itertools import pairwise
from math import radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.gaze.lids.lids import LidOpenings, LidParams, Lids, Side
from gazerig.gaze.types import GazeCommand
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

DT = 0.005
AWAKE = 0.8
SHUT_S = 0.085  # after the onset: between close_ms and close_ms + hold_ms


def lids(seed: int = 0, **params: float) -> Lids:
    """Return lids that blink with every large shift and never else."""
    always = LidParams(
        blinks_per_min=0.0,
        incomplete_share=0.0,
        gaze_evoked_blink_literal=True,
        gaze_evoked_blink_pause_ms=0.0,
        gaze_evoked_blink_jitter_ms=0.0,
    )
    return Lids(changed(always, **params), np.random.default_rng(seed))


def changed(params: LidParams, **changes: float) -> LidParams:
    return LidParams(**{**vars(params), **changes})


def blinked(model: Lids, t_s: float, pitch_deg: float = 0.0) -> LidOpenings:
    """Begin a blink at a time and give the openings while it is shut."""
    assert not model.step(t_s, radians(pitch_deg), radians(90.0)).blink
    shut = model.step(t_s + SHUT_S, radians(pitch_deg), None)
    assert shut.blink
    return shut


def largest_step(model: Lids, start_s: float, seconds: float) -> float:
    """Return the largest change of a lower lid from one tick to the next."""
    trace = [model.step(start_s + k * DT, 0.0, None)[3:] for k in range(round(seconds / DT))]
    return float(np.abs(np.diff(trace, axis=0)).max())


def test_upper_lids_move_as_if_there_were_no_lower_ones() -> None:
    def uppers(**lower: float) -> list[tuple[float, float, bool]]:
        model, rows = Lids(changed(LidParams(), **lower), np.random.default_rng(11)), []
        for k in range(6000):
            if k == 1000:
                model.wink("left", k * DT)
            if k == 2000:
                model.set_sleepiness(0.6)
            if k == 3000:
                model.set_mode("conversation")
            shift = radians(25.0) if k % 700 == 0 else None
            rows.append(model.step(k * DT, radians(20.0) * sin(0.7 * k * DT), shift)[:3])
        return rows

    plain = uppers()
    assert sum(b[2] and not a[2] for a, b in pairwise(plain)) >= 8
    assert plain == uppers(lower_rest_opening=0.3, lower_close_share=0.1, lower_sleepy_rise=0.9)


@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0))
def test_the_middle_of_the_fissure_goes_where_the_eye_goes(
    one_deg: float, other_deg: float
) -> None:
    model = lids()
    down, up = (model.step(0.0, radians(a), None) for a in sorted((one_deg, other_deg)))
    assert up.left >= down.left and up.lower_left <= down.lower_left


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
    steep = lids(lower_follow_per_deg=0.1)
    assert steep.step(0.0, radians(80.0), None).lower_left == 0.0


@pytest.mark.parametrize("pitch_deg", [-60.0, -30.0, -10.0, 0.0, 10.0, 30.0, 60.0])
@pytest.mark.parametrize("level", [0.0, 1.0])
def test_upper_and_lower_lids_meet_in_a_blink_wherever_the_eye_looks(
    pitch_deg: float, level: float
) -> None:
    shut = blinked(lids(sleepy_level=level, sleepy_slowness=0.0), 1.0, pitch_deg)
    assert (shut.left, shut.right, shut.lower_left, shut.lower_right) == (0.0,) * 4


def test_an_incomplete_blink_stops_both_lids_half_way() -> None:
    shut = blinked(lids(incomplete_share=1.0), 1.0)
    part = shut.left / 0.75
    assert 0.05 <= part <= 0.4
    assert shut.lower_left / AWAKE == pytest.approx(part)


def test_lids_that_meet_have_their_joints_at_the_calibrated_ends() -> None:
    ends = {
        "left_upper_lid": (radians(-20.0), radians(25.0)),
        "right_upper_lid": (radians(-22.0), radians(24.0)),
        "left_lower_lid": (radians(-8.0), radians(22.0)),
        "right_lower_lid": (radians(-9.0), radians(21.0)),
    }
    kinematics = Kinematics(GeometryParams(0.0, 0.0, 0.0), ends, ends)
    shut, level = blinked(lids(), 1.0, -25.0), lids().step(0.0, 0.0, None)

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


def test_a_lower_lid_may_take_little_part_in_blinks_and_winks_as_in_people() -> None:
    model = lids(lower_close_share=0.1)
    shut = blinked(model, 1.0)
    assert shut.left == 0.0 and shut.lower_left == pytest.approx(0.9 * AWAKE)
    model.step(2.0, 0.0, None)
    model.wink("right", 2.0)
    shut = model.step(2.0 + SHUT_S, 0.0, None)
    assert shut.right == 0.0 and shut.lower_right == pytest.approx(0.9 * AWAKE)
    still = lids(lower_close_share=0.0)
    assert blinked(still, 1.0).lower_left == AWAKE


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_wink_shuts_both_lids_of_one_eye(side: Side) -> None:
    model, index = lids(), 3 if side == "left" else 4
    model.step(0.995, 0.0, None)
    model.wink(side, 1.0)
    trace = np.array([model.step(1.0 + k * DT, 0.0, None) for k in range(200)])
    assert 0.2 <= (trace[:, index] < 0.001).sum() * DT <= 0.25
    assert (trace[:, 7 - index] == AWAKE).all()
    assert trace[-1, index] == AWAKE


def test_sleepiness_raises_a_lower_lid_by_little_and_slowly() -> None:
    model = lids()
    model.step(1.0, 0.0, None)
    model.set_sleepiness(1.0)
    assert largest_step(model, 1.0, 1.5) <= 1.875 * 0.1 * AWAKE * DT + 1e-9
    drowsy = model.step(2.5, 0.0, None)
    assert drowsy.lower_left == pytest.approx(0.9 * AWAKE)
    assert 1.0 - drowsy.left / 0.75 > 5.0 * (1.0 - drowsy.lower_left / AWAKE)
    # Far down it cannot go beyond open, and sleepiness takes its part of that.
    assert model.step(2.5, radians(-80.0), None).lower_left == pytest.approx(0.9)


def test_lower_lids_glide_to_what_they_are_retuned_to() -> None:
    model = lids()
    before = model.step(1.0, 0.0, None).lower_left
    model.retune(changed(LidParams(), blinks_per_min=0.0, lower_rest_opening=0.3))
    assert model.step(1.0, 0.0, None).lower_left == before
    assert largest_step(model, 1.0, 0.35) <= 1.875 * 0.5 * DT / 0.3 + 1e-9
    assert model.step(1.35, 0.0, None).lower_left == 0.3
    fresh = lids()
    fresh.retune(LidParams(lower_rest_opening=0.3))
    first = fresh.step(0.0, 0.0, None)
    assert (first.left, first.lower_left) == (0.75, 0.3)  # nothing was shown to glide from


def test_a_blink_under_way_keeps_the_part_that_the_lower_lid_takes() -> None:
    model = lids()
    shut = blinked(model, 1.0)
    model.retune(changed(LidParams(), blinks_per_min=0.0, lower_close_share=0.0))
    after = model.step(1.0 + SHUT_S + DT, 0.0, None)
    assert after.lower_left == shut.lower_left == 0.0
    model.step(2.0, 0.0, None)
    model.wink("left", 2.0)
    assert model.step(2.0 + SHUT_S, 0.0, None).lower_left == AWAKE


def test_a_blink_that_is_over_does_not_come_back_when_blinks_are_made_longer() -> None:
    model = lids()
    blinked(model, 1.0)
    model.wink("left", 1.1)
    model.step(1.6, 0.0, None)
    long = {"close_ms": 500.0, "hold_ms": 1000.0, "open_ms": 1500.0, "wink_hold_ms": 3000.0}
    model.retune(changed(LidParams(), blinks_per_min=0.0, **long))
    for k in range(1, 400):
        assert model.step(1.6 + k * DT, 0.0, None) == (0.75, 0.75, False, AWAKE, AWAKE)


def test_a_higher_rate_begins_no_blink_within_a_blink() -> None:
    slow = LidParams(
        interval_distribution="fixed",
        duration_spread=0.0,
        incomplete_share=0.0,
        sleepy_level=1.0,
        gaze_evoked_blink_jitter_ms=0.0,
        gaze_evoked_blink_replaces=False,
    )
    model = Lids(changed(slow, sleepy_slowness=5.0), np.random.default_rng(0))
    assert not model.step(0.0, 0.0, radians(90.0)).blink and model.blinks == 1
    assert model.step(0.5, 0.0, None).lower_left == 0.0
    model.retune(changed(slow, sleepy_slowness=5.0, blinks_per_min=60.0))
    # Wanted from 1.4 s on by the new rate, but this one lasts until 1.7 s.
    assert largest_step(model, 0.5, 1.2) <= 2.2 / (6.0 * 0.175) * DT
    assert model.blinks == 1
    assert model.step(1.72, 0.0, None) and model.blinks == 2

"""Travel of the head from any start to any target: never past it."""

from math import degrees, radians
from typing import Literal

import numpy as np
import pytest
from gaze_targets import DT, target, turn
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.gaze.angles import angle_between, direction
from gazerig.gaze.oculomotor.head import HeadModel, HeadParams, HeadShare
from gazerig.gaze.types import Angles2, Target

human_norms = pytest.importorskip("gazerig.features.lab.analysis.human_norms")

NECK = ((-2.0, 2.0), (-1.2, 1.2))
ROLL = (radians(-25.0), radians(25.0))
Model = Literal["attention", "align", "stahl"]

MODELS = st.sampled_from(("attention", "align", "stahl"))
PLACES = st.tuples(st.floats(-75.0, 75.0), st.floats(-40.0, 40.0))
INTERESTS = st.floats(0.0, 1.6)
EYES = st.floats(10.0, 60.0)


def ends(
    model: Model, eyes_deg: float, start: Angles2, place: Angles2, salience: float
) -> tuple[float, float, float]:
    """Let a head at rest turn to a place; angles in degrees.

    Returns:
        The target's arc from the start, how far the head went, and what is left to the target.
    """
    params = HeadParams(goal_model=model)
    head = HeadModel(params, radians(eyes_deg), NECK, ROLL)
    at = (radians(start[0]), radians(start[1]))
    facing = (radians(place[0]), radians(place[1]))
    head.reset(0.0, (*at, 0.0))
    seen = target(salience=salience)
    arc = angle_between(direction(at), direction(facing))
    for t in (0.0, 0.4, 2.9):
        yaw, pitch, _ = head.step(seen, facing, facing, arc, 1.0, t)
    way = direction((yaw, pitch))
    went, left = angle_between(direction(at), way), angle_between(way, direction(facing))
    return degrees(arc), degrees(went), degrees(left)


@settings(max_examples=300, deadline=None)
@given(MODELS, EYES, PLACES, PLACES, INTERESTS)
def test_e65_the_head_never_goes_past_the_target_as_seen_from_where_it_comes(
    model: Model, eyes_deg: float, start: Angles2, place: Angles2, salience: float
) -> None:
    arc, went, left = ends(model, eyes_deg, start, place, salience)
    assert went <= arc + 1e-6
    assert went + left == pytest.approx(arc, abs=1e-4), "along the great circle"


@settings(max_examples=300, deadline=None)
@given(MODELS, EYES, PLACES, PLACES, INTERESTS, INTERESTS)
def test_e65_less_interest_never_turns_the_head_further(
    model: Model, eyes_deg: float, start: Angles2, place: Angles2, one: float, other: float
) -> None:
    less, more = sorted((one, other))
    moved = [ends(model, eyes_deg, start, place, salience)[1] for salience in (less, more)]
    assert moved[0] <= moved[1] + 1e-6


@pytest.mark.parametrize("range_deg", [0.0, 35.8, 60.0])
def test_e75_stahls_law_holds_for_any_range_of_the_eyes(range_deg: float) -> None:
    share = HeadShare(HeadParams(eye_only_range_deg=range_deg), radians(170.0))
    for arc_deg in (0.0, 20.0, 70.0):
        went = radians(arc_deg) - share.undershoot_rad(0.5, radians(arc_deg))
        law = 0.77 * max(0.0, arc_deg - range_deg / 2.0)
        assert degrees(went) == pytest.approx(law, abs=1e-9)


@pytest.mark.parametrize("start", [-60.0, -20.0, 0.0, 35.0, 60.0])
@pytest.mark.parametrize("place", [-60.0, -31.0, 0.0, 16.0, 25.0, 60.0])
def test_e75_the_model_goes_as_far_as_the_report_expects_of_people(
    start: float, place: float
) -> None:
    arc, went, _ = ends("stahl", 75.0, (start, 0.0), (place, 0.0), 0.5)
    assert went == pytest.approx(
        human_norms.STAHL_SLOPE * max(0.0, arc - human_norms.STAHL_FREE_DEG), abs=1.0
    )


def model() -> HeadModel:
    return HeadModel(HeadParams(), radians(35.0), NECK, ROLL)


def test_e65_a_head_in_flight_stops_where_it_can_and_not_behind_a_nearer_target() -> None:
    yaws = turn(
        model(), 2.0, lambda t: (target(), 65.0) if t < 0.25 else (target(id=2, shift=2), 30.0)
    )
    assert 3.0 < yaws[50] < 20.0
    assert yaws.max() <= 30.0
    assert np.diff(yaws[50:]).min() > -0.02, "it does not swing back"


def test_e65_eyes_that_are_being_brought_back_do_not_take_the_head_to_the_next_target() -> None:
    yaws = turn(model(), 4.9, lambda t: (target(), 50.0) if t < 3.9999 else (target(id=0), 38.0))
    assert yaws[801] > yaws[600] + 2.0, "it is being brought back"
    assert yaws[-1] == pytest.approx(yaws[801], abs=2.0), "the eyes go alone"


def test_parts_of_a_face_do_not_pull_the_head_further_each_time() -> None:
    """The same person all the while: the law counts from where the head was at first."""
    rng = np.random.default_rng(0)

    def part(t: float) -> tuple[Target, float]:
        return target(shift=round(t / DT) // 60), 45.0 + 2.0 * float(rng.standard_normal())

    yaws = turn(HeadModel(HeadParams(), radians(50.0), NECK, ROLL), 2.9, part, facing_deg=45.0)
    assert yaws[-1] == pytest.approx(0.77 * (45.0 - 17.9), abs=0.5)


@settings(max_examples=100, deadline=None)
@given(st.floats(-80.0, 80.0), INTERESTS, INTERESTS)
def test_e75_the_roll_goes_to_the_side_of_the_target_and_grows_with_interest(
    yaw_deg: float, one: float, other: float
) -> None:
    share = HeadShare(HeadParams(), radians(35.0))
    less, more = (abs(share.roll_rad(s, radians(yaw_deg))) for s in sorted((one, other)))
    assert less <= more + 1e-12 and degrees(more) <= 4.0
    assert share.roll_rad(one, radians(yaw_deg)) * yaw_deg <= 0.0
    if abs(yaw_deg) >= 20.0:
        assert degrees(less) >= 1.0


@pytest.mark.parametrize("seed", range(4))
def test_e75_a_roll_does_not_swing_when_the_head_is_called_elsewhere(seed: int) -> None:
    rng, angles = np.random.default_rng(seed), (0.0, 0.0, 0.0)
    facing, name = (0.0, 0.0), 0
    head, rolls = model(), []
    for k in range(6000):
        if k % 60 == 0 and rng.random() < 0.4:
            facing, name = (radians(float(rng.uniform(-70.0, 70.0))), 0.0), k
        seen = target(id=name, salience=1.0, shift=name)
        angles = head.step(seen, facing, facing, abs(facing[0] - angles[0]), 1.0, k * DT)
        rolls.append(degrees(angles[2]))
    assert 3.0 < max(map(abs, rolls)) < 5.5


def test_e75_a_neck_without_a_roll_joint_does_not_roll() -> None:
    facing, seen, rolls = (radians(60.0), 0.0), target(salience=1.0), []
    for limits in ((0.0, 0.0), ROLL):
        head = HeadModel(HeadParams(), radians(35.0), NECK, limits)
        for t in (0.0, 0.5, 2.9):
            roll = head.step(seen, facing, facing, radians(60.0), 1.0, t)[2]
        rolls.append(degrees(roll))
    assert rolls[0] == 0.0 and rolls[1] == pytest.approx(-4.0, abs=0.1)

"""Head goal, timing and trajectory. Numbered checks are listed in docs/checks.md."""

from collections.abc import Callable
from math import degrees, radians

import numpy as np
import pytest
from gaze_targets import DT, target, turn

from gazerig.gaze.angles import direction
from gazerig.gaze.minimum_jerk import Quintic
from gazerig.gaze.oculomotor.head import HeadModel, HeadParams
from gazerig.gaze.types import Floats

NECK = ((-2.0, 2.0), (-1.0, 1.0))
EQ_7 = HeadParams(goal_model="attention")


def head(eye_deg: float = 55.0, params: HeadParams | None = None) -> HeadModel:
    return HeadModel(
        params or HeadParams(goal_model="attention", min_salience=0.0),
        radians(eye_deg),
        NECK,
    )


def goal_deg(
    model: HeadModel, yaw: float, salience: float, pitch: float = 0.0
) -> tuple[float, float]:
    goal = model.goal_rad((radians(yaw), radians(pitch)), model.share.offset_rad(salience))
    return degrees(goal[0]), degrees(goal[1])


def test_e11_more_attention_turns_the_head_further() -> None:
    goals = [goal_deg(head(), 50.0, a)[0] for a in np.linspace(0.0, 1.0, 50)]
    assert goals[0] == pytest.approx(20.03, abs=0.01)
    assert goals[-1] == pytest.approx(49.97, abs=0.01)
    assert all(b > a for a, b in zip(goals, goals[1:], strict=False))


@pytest.mark.parametrize(("x", "offset"), [(0.25, 29.121), (0.5, 15.000), (0.75, 0.879)])
def test_e12_offset_values(x: float, offset: float) -> None:
    assert degrees(head().share.offset_rad(x)) == pytest.approx(offset, abs=0.01)


def test_other_side_mirrors_and_near_targets_give_straight_ahead() -> None:
    assert goal_deg(head(), -50.0, 0.5)[0] == pytest.approx(-goal_deg(head(), 50.0, 0.5)[0])
    assert goal_deg(head(), 10.0, 0.0) == (0.0, 0.0)


def test_two_dimensional_targets_are_shortened_along_the_great_circle() -> None:
    yaw, pitch = goal_deg(head(), 40.0, 0.5, pitch=20.0)
    assert yaw == pytest.approx(25.71, abs=0.01)
    assert pitch == pytest.approx(13.80, abs=0.01)


@pytest.mark.parametrize("short_deg", [5.0, 40.0, 70.0, 120.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_head_turns_to_the_side_of_a_target_behind_it(short_deg: float, side: float) -> None:
    """The shorter arc to it goes through the back, where no neck turns."""
    start = direction((radians(-11.0 * side), 0.0))
    yaw, pitch = head().goal_rad((radians(174.0 * side), 0.1), radians(short_deg), start)
    assert yaw == 2.0 * side and 0.1 <= pitch < 0.2


def test_goal_stays_in_the_neck_range() -> None:
    model = HeadModel(HeadParams(), radians(35.0), ((-0.5, 0.5), (-0.2, 0.3)))
    assert model.goal_rad((2.0, 1.2), 0.0)[0] == 0.5
    assert model.goal_rad((0.0, 1.2), 0.0)[1] == 0.3


def test_from_rest_the_plan_is_eq_8() -> None:
    plan = Quintic((0.1, 0.0, 0.0), 0.7, 0.8)
    for s in np.linspace(0.0, 1.0, 11):
        expected = 0.1 + 0.6 * (6 * s**5 - 15 * s**4 + 10 * s**3)
        assert plan.state_at(0.8 * s)[0] == pytest.approx(expected, abs=1e-12)


def test_a_new_goal_in_flight_makes_no_step() -> None:
    first = Quintic((0.0, 0.0, 0.0), 1.0, 0.8)
    now = first.state_at(0.3)
    second = Quintic(now, -0.5, 0.6)
    assert second.state_at(0.0) == pytest.approx(now)
    assert second.state_at(0.6) == pytest.approx((-0.5, 0.0, 0.0))
    assert second.state_at(9.0) == (-0.5, 0.0, 0.0)


def test_an_eye_held_aside_is_relieved_slowly() -> None:
    model = HeadModel(HeadParams(eye_only_range_deg=60.0), radians(35.0), NECK)
    moved = turn(model, 8.0, lambda t: (target(kind="thing", top_down=True), 21.0))
    assert np.abs(moved[:600]).max() == 0.0
    assert moved[-1] == pytest.approx(21.0 - 5.0, abs=0.5)
    assert np.abs(np.diff(moved)).max() / DT <= 12.0 + 1e-6


def aimed(params: HeadParams, centre: float, point: float, eye_deg: float = 20.0) -> float:
    """Return where a shift brings the head for a far centre and a point."""
    model = HeadModel(params, radians(eye_deg), NECK)
    return float(turn(model, 2.5, lambda t: (target(), point), centre)[-1])


def test_head_turns_to_the_centre_but_never_so_that_the_point_is_out_of_reach() -> None:
    assert aimed(HeadParams(), 40.0, 39.0) == pytest.approx(40.0 - 18.0, abs=0.1)
    assert aimed(HeadParams(), 40.0, 50.0) == pytest.approx(50.0 - 18.0, abs=0.1)


def test_alignment_faces_the_target_once_it_is_beyond_the_eyes() -> None:
    params = HeadParams(goal_model="align", max_offset_deg=20.0)
    assert aimed(params, 50.0, 50.0) == pytest.approx(50.0, abs=0.1)
    assert aimed(params, 19.0, 19.0) == 0.0


@pytest.mark.parametrize(
    ("eye_deg", "place", "head_deg"),
    [
        (20.0, 30.0, 12.0),
        (20.0, 40.0, 22.0),
        (20.0, 60.0, 42.0),
        (55.0, 40.0, 0.77 * (40.0 - 17.9)),
    ],
)
def test_stahl_share_is_lifted_where_the_eyes_cannot_reach(
    eye_deg: float, place: float, head_deg: float
) -> None:
    params = HeadParams(goal_model="stahl")
    assert aimed(params, place, place, eye_deg) == pytest.approx(head_deg, abs=0.1)


def test_literal_reach_keeps_30_degrees_and_so_the_gaze_short() -> None:
    params = HeadParams(goal_model="attention", min_salience=0.5)
    model = HeadModel(params, radians(20.0), NECK)
    assert degrees(model.share.trigger_rad) == pytest.approx(30.0)
    assert degrees(model.share.offset_rad(0.5)) == pytest.approx(29.97, abs=0.01)
    # 60 - 30.03 - 20: the 9.97 deg that no eye of 20 deg covers.
    assert 60.0 - goal_deg(model, 60.0, 0.5)[0] - 20.0 == pytest.approx(9.97, abs=0.01)


@pytest.mark.parametrize(
    ("size", "peak"), [(20.0, 65.0), (30.0, 84.0), (40.0, 103.0), (60.0, 140.0)]
)
def test_larger_head_movements_are_faster(size: float, peak: float) -> None:
    model = HeadModel(HeadParams(goal_model="align"), radians(5.0), NECK)
    yaws = turn(model, 2.0, lambda t: (target(salience=2.0, top_down=True), size))
    assert np.diff(yaws).max() / DT == pytest.approx(peak, abs=1.5)


def turned(params: HeadParams, yaw: float, salience: Callable[[float], float]) -> Floats:
    """Return the head's yaws of 4 s with a face at a yaw whose salience changes; degrees."""
    return turn(head(35.0, params), 4.0, lambda t: (target(salience=salience(t)), yaw))


def test_a_head_does_not_turn_away_because_the_interest_has_fallen() -> None:
    yaws = turned(EQ_7, 36.0, lambda t: 1.5 if t < 0.5 else 0.5)
    assert np.diff(yaws).min() > -1e-9
    assert 30.0 < yaws[-1] <= 36.0


def test_an_eye_left_aside_by_a_shift_is_relieved_by_people_alone() -> None:
    """The head stops short of the target; after 3 s it comes after the eyes."""
    yaws = turned(HeadParams(), 50.0, lambda t: 0.2)
    assert yaws[int(0.6 / DT)] < 26.0 and yaws[-1] > yaws[500] + 3.0
    paper = turned(EQ_7, 50.0, lambda t: 0.2)
    assert paper[-1] == paper[300] and paper[-1] == pytest.approx(20.03, abs=0.1)


def test_plans_made_in_full_flight_stay_in_the_neck_range() -> None:
    model = HeadModel(HeadParams(), radians(35.0), ((-0.9, 0.9), (-0.5, 0.5)))
    places = np.degrees(np.random.default_rng(5).uniform(-1.4, 1.4, 300)).tolist()
    seen = target(salience=2.0, top_down=True)
    yaws = turn(model, 60.0, lambda t: (seen, places[round(t / DT) // 40]))
    assert np.abs(yaws).max() <= np.degrees(0.9)

"""Head goal, timing and trajectory. Numbered checks are listed in docs/checks.md."""

from collections.abc import Callable
from math import degrees, radians
from typing import Any

import numpy as np
import pytest

from gazerig.gaze.angles import direction
from gazerig.gaze.minimum_jerk import Quintic
from gazerig.gaze.oculomotor.head import HeadModel, HeadParams
from gazerig.gaze.types import Floats, Target

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
    model.reset(0.0, (0.0, 0.0, 0.0))
    target = Target((1.0, 0.4, 0.0), (0, 0, 0), 0.0, "thing", 1, 0.5, True, None, 1, "")
    yaw = radians(21.0)
    trace: list[Any] = []
    for k in range(1600):
        t = k * 0.005
        aside = abs(yaw - (trace[-1] if trace else 0.0))
        now = model.step(target, (yaw, 0.0), (yaw, 0.0), aside, 1.0, t)
        trace.append(now[0])
    moved = np.degrees(np.array(trace))
    assert np.abs(moved[:600]).max() == 0.0
    assert moved[-1] == pytest.approx(21.0 - 5.0, abs=0.5)
    assert np.abs(np.diff(moved)).max() / 0.005 <= 12.0 + 1e-6


def aimed(params: HeadParams, centre: float, point: float, top_down: bool = False) -> float:
    """Return where a shift brings the head (eye range 20 deg) for a far centre and a point."""
    model = HeadModel(params, radians(20.0), NECK)
    target = Target((1.0, 0, 0), (0, 0, 0), 0.0, "face", 1, 0.5, top_down, None, 1, "")
    facing, gaze, yaw = (radians(centre), 0.0), (radians(point), 0.0), 0.0
    for k in range(500):
        yaw = model.step(target, facing, gaze, abs(gaze[0] - yaw), 1.0, k * 0.005)[0]
    return degrees(yaw)


def test_head_turns_to_the_centre_but_never_so_that_the_point_is_out_of_reach() -> None:
    assert aimed(HeadParams(), 40.0, 39.0) == pytest.approx(40.0 - 18.0, abs=0.1)
    assert aimed(HeadParams(), 40.0, 50.0) == pytest.approx(50.0 - 18.0, abs=0.1)


def test_alignment_faces_the_target_once_it_is_beyond_the_eyes() -> None:
    params = HeadParams(goal_model="align", max_offset_deg=20.0)
    assert aimed(params, 50.0, 50.0) == pytest.approx(50.0, abs=0.1)
    assert aimed(params, 19.0, 19.0) == 0.0


@pytest.mark.parametrize(("target", "head_deg"), [(30.0, 12.0), (40.0, 22.0), (60.0, 42.0)])
def test_stahl_share_is_lifted_where_the_eyes_cannot_reach(target: float, head_deg: float) -> None:
    params = HeadParams(goal_model="stahl")
    assert aimed(params, target, target) == pytest.approx(head_deg, abs=0.1)


def test_stahl_share_of_a_wide_eye_range() -> None:
    model = HeadModel(HeadParams(goal_model="stahl"), radians(55.0), NECK)
    target = Target((1.0, 0, 0), (0, 0, 0), 0.0, "face", 1, 0.5, True, None, 1, "")
    facing = (radians(40.0), 0.0)
    for k in range(500):
        yaw = model.step(target, facing, facing, radians(40.0), 1.0, k * 0.005)[0]
    assert degrees(yaw) == pytest.approx(0.77 * (40.0 - 17.9), abs=0.1)


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
    model.reset(0.0, (0.0, 0.0, 0.0))
    target = Target((1.0, 0, 0), (0, 0, 0), 0.0, "face", 1, 2.0, True, None, 1, "")
    facing = (radians(size), 0.0)
    trace = [
        degrees(model.step(target, facing, facing, radians(size), 1.0, k * 0.005)[0])
        for k in range(400)
    ]
    assert np.diff(trace).max() / 0.005 == pytest.approx(peak, abs=1.5)


def turned(params: HeadParams, yaw: float, salience: Callable[[float], float]) -> Floats:
    """Return the head's yaws of 4 s with a face at a yaw whose salience changes; degrees."""
    model, yaws = head(35.0, params), [0.0]
    place = (radians(yaw), 0.0)
    for k in range(800):
        t = k * 0.005
        target = Target((1, 0, 0), (0, 0, 0), t, "face", 1, salience(t), False, None, 0, "")
        yaws.append(model.step(target, place, place, abs(place[0] - yaws[-1]), 1.0, t)[0])
    return np.degrees(yaws)


def test_a_head_does_not_turn_away_because_the_interest_has_fallen() -> None:
    yaws = turned(EQ_7, 36.0, lambda t: 1.5 if t < 0.5 else 0.5)
    assert np.diff(yaws).min() > -1e-9
    assert 30.0 < yaws[-1] <= 36.0


def test_an_eye_left_aside_by_a_shift_is_relieved_by_people_alone() -> None:
    """The head stops short of the target; after 3 s it comes after the eyes."""
    yaws = turned(HeadParams(), 50.0, lambda t: 0.2)
    assert yaws[int(0.6 / 0.005)] < 26.0 and yaws[-1] > yaws[500] + 3.0
    paper = turned(EQ_7, 50.0, lambda t: 0.2)
    assert paper[-1] == paper[300] and paper[-1] == pytest.approx(20.03, abs=0.1)


def test_plans_made_in_full_flight_stay_in_the_neck_range() -> None:
    model = HeadModel(HeadParams(), radians(35.0), ((-0.9, 0.9), (-0.5, 0.5)))
    places = np.random.default_rng(5).uniform(-1.4, 1.4, 300).tolist()
    yaws = [0.0]
    for k in range(12_000):
        t = k * 0.005
        place = (places[k // 40], 0.0)
        target = Target((1, 0, 0), (0, 0, 0), t, "face", 1, 2.0, True, None, 0, "")
        yaws.append(model.step(target, place, place, abs(place[0] - yaws[-1]), 1.0, t)[0])
    assert max(map(abs, yaws)) <= 0.9

"""A gaze steered over a face: the nearest one, the eyes on the point, and what is refused."""

from collections.abc import Iterator
from math import degrees, inf
from typing import Any

import pytest

from gazerig.config.schema import load_rig
from gazerig.features.bringup.calibration.face_calibration import initial_calibration, point_world_m
from gazerig.features.bringup.calibration.face_steering import (
    AIMED_DEG,
    STALE_S,
    WAIT_S,
    FaceSteering,
)
from gazerig.gaze.angles import angle_between, rotation, sub
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Bodies, Face, Percept, Target
from gazerig.robot.app.assemble import Assembly, Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick
from gazerig.sim_mock.scenes.sits_still import SitsStill

RIG = load_rig("desk")
REST = (1.5, 0.0, 0.2)
TOP_DOWN: Any = object()
POSE: Any = type("Pose", (), {"p_world_head_m": (0.0, 0.0, 0.1)})()


def face(number: int, x: float, y: float = 0.0, yaw: float = 3.1) -> Face:
    return Face(number, (x, y, 0.2), (0.0, 0.0, 0.0), rotation((yaw, 0.0, 0.0)), (), 0.9)


def steering() -> FaceSteering:
    return FaceSteering(initial_calibration({}), TOP_DOWN, REST)


def chosen(made: FaceSteering, t_s: float, *faces: Face, captured_s: float | None = None) -> Target:
    seen = Percept(t_s if captured_s is None else captured_s, Bodies(), faces)
    return made.choose(seen, POSE, t_s)


# --- whom it looks at


def test_of_several_faces_the_nearest_and_then_the_same() -> None:
    made = steering()
    assert chosen(made, 0.0, face(1, 1.2), face(2, 0.8)).id == 2
    assert chosen(made, 0.1, face(1, 0.6), face(2, 0.8)).id == 2
    assert chosen(made, 0.2, face(1, 0.6)).id == 1


def test_the_part_goes_with_the_face_and_the_head_with_its_centre() -> None:
    made = steering()
    chosen(made, 0.0, face(1, 1.0))
    assert made.press("left", 0.0) is None
    for yaw in (2.6, 3.1, 3.6):
        there = face(1, 0.9, 0.2, yaw)
        target = chosen(made, 0.1, there)
        expected = point_world_m((0.0, 5.0, 0.0), there.p_world_m, there.R_world_face)
        assert target.p_world_m == pytest.approx(expected)
        assert target.centre_world_m == there.p_world_m and target.part == "N"


def test_another_point_is_another_shift_and_the_same_point_none() -> None:
    made = steering()
    first = chosen(made, 0.0, face(1, 1.0)).shift
    assert chosen(made, 0.1, face(1, 1.1)).shift == first
    made.press("up", 0.1)
    assert chosen(made, 0.2, face(1, 1.1)).shift == first + 1


def test_with_nobody_there_it_waits_where_somebody_was_then_rests() -> None:
    made = steering()
    assert made.choose(None, POSE, 0.0).p_world_m == REST
    seen = chosen(made, 1.0, face(1, 1.0))
    lost = chosen(made, 2.0)
    assert (lost.kind, lost.p_world_m) == ("rest", seen.p_world_m)
    assert chosen(made, 7.0).p_world_m == REST


def test_a_stale_picture_shows_nobody_and_keys_wait() -> None:
    made = steering()
    chosen(made, 1.0, face(1, 1.0))
    assert chosen(made, 2.0, face(1, 1.0), captured_s=1.9 - STALE_S).kind == "rest"
    assert "no face is seen" in (made.press("left", 2.0) or "")
    assert made.state == initial_calibration({}) and not made.is_aimed
    assert made.press("end", 2.0) is None and made.state.part is None


# --- what the eyes of an emulated rig do


@pytest.fixture
def steered() -> FaceSteering:
    return FaceSteering(initial_calibration({}), TopDown(RIG.gaze.top_down), REST)


@pytest.fixture
def made(steered: FaceSteering) -> Iterator[Assembly]:
    options = RunOptions(mock=True, fast=True, seed=1, scene="sits-still")
    found = assemble(RIG, options, Substitutes(chooser=lambda own: steered))
    yield found
    found.close()


def ticks(made: Assembly, steered: FaceSteering, seconds: float) -> Tick:
    """Run in simulated time, where nothing stands against an Enter."""
    start_s, last_s, tick = made.clock.now_s(), made.clock.now_s(), None
    for slot in range(1, int(seconds * 200) + 1):
        made.clock.sleep_until(start_s + slot / 200)
        t_s = made.clock.now_s()
        tick = made.robot.tick(t_s, t_s - last_s)
        assert steered.update(tick) is None
        last_s = t_s
    assert tick is not None
    return tick


def test_both_eyes_meet_the_true_place_of_the_part_on_the_face(
    made: Assembly, steered: FaceSteering
) -> None:
    made.robot.start(made.clock)
    (person,) = SitsStill().people(0.0)
    yaw, pitch = person.face_yaw_pitch_rad
    ticks(made, steered, 1.5)
    for _ in range(3):
        for key in ("left", "up", "up"):
            assert steered.press(key, made.clock.now_s()) is None
        part = steered.state.part
        assert part is not None
        true = point_world_m(
            steered.state.place_mm(part), person.p_world_face_m, rotation((yaw, pitch, 0.0))
        )
        pose = ticks(made, steered, 0.6).pose
        left = angle_between(line_of_sight(pose, True), sub(true, pose.p_world_eye_left_m))
        right = angle_between(line_of_sight(pose, False), sub(true, pose.p_world_eye_right_m))
        assert steered.is_aimed and degrees(max(left, right)) < AIMED_DEG
        steered.press("enter", made.clock.now_s())
        ticks(made, steered, 0.1)
        assert part in steered.state.chosen and steered.state.part != part


def test_an_enter_waits_for_eyes_on_their_way(made: Assembly, steered: FaceSteering) -> None:
    made.robot.start(made.clock)
    ticks(made, steered, 1.5)
    for _ in range(12):
        steered.press("left", made.clock.now_s())
    steered.press("enter", made.clock.now_s())
    ticks(made, steered, 0.01)
    assert steered.state.part == "N"
    ticks(made, steered, 0.5)
    assert steered.state.part == "LE"


def test_an_enter_is_dropped_with_a_reason_where_the_eyes_never_come(
    made: Assembly, steered: FaceSteering
) -> None:
    made.robot.start(made.clock)
    tick = ticks(made, steered, 1.0)
    steered.press("enter", tick.t_s)
    # Eyes that are measured elsewhere, whatever was asked of them.
    aside = tick.pose._replace(eye_left_rad=(0.3, 0.0))
    assert steered.update(tick._replace(t_s=tick.t_s + 0.1, pose=aside)) is None
    why = steered.update(tick._replace(t_s=tick.t_s + WAIT_S + 0.1, pose=aside))
    assert why is not None and "not taken" in why and steered.state.part == "N"


def test_eyes_in_a_saccade_are_not_on_the_part(made: Assembly, steered: FaceSteering) -> None:
    made.robot.start(made.clock)
    tick = ticks(made, steered, 1.7)
    steered.update(tick._replace(gaze=tick.gaze._replace(phase="fixate")))
    assert steered.is_aimed
    steered.update(tick._replace(gaze=tick.gaze._replace(phase="saccade")))
    assert steered.error_deg == inf and not steered.is_aimed

"""Keys to offsets in the face's own frame, and from there to points in the world."""

from collections.abc import Iterator
from math import degrees, radians
from typing import Any, get_args

import pytest
from fakes.runs import simulated
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import Rig
from gazerig.features.bringup.calibration.face_steering import (
    AIMED_DEG,
    FARTHEST_MM,
    ORDER,
    STALE_S,
    FaceCalibration,
    FaceSteering,
    Key,
    point_world_m,
)
from gazerig.features.bringup.cli.calibrate.face import exact_gaze
from gazerig.gaze.angles import angle_between, compose, rotation, sub
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Bodies, Face, Percept, Target
from gazerig.robot.loop.loop import Tick
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.run.run import Run
from gazerig.robot.run.surroundings import load_scene

KEYS = st.lists(st.sampled_from(get_args(Key)), max_size=60)


def after(*keys: Key) -> FaceCalibration:
    state = FaceCalibration({})
    for key in keys:
        state.apply(key)
    return state


@given(KEYS)
def test_no_keys_lead_off_the_face_or_out_of_its_plane(keys: list[Key]):
    state = FaceCalibration({})
    for key in keys:
        state.apply(key)
    for part in ORDER:
        x, y, z = state.places_mm[part]
        assert x == pytest.approx(PARTS_FACE_M[part][0] * 1e3)
        assert abs(y) <= FARTHEST_MM and abs(z) <= FARTHEST_MM
    assert {key.partition(".")[2] for key in state.changed_places()} == set(state.adjusted_parts)


def test_left_is_the_owners_left_and_up_is_up_whatever_the_face_does():
    state = after("left", "up")
    assert state.places_mm["N"] == (0.0, 5.0, 5.0)
    # A face that looks back at the robot has its left at the world's -y.
    facing = rotation((radians(180.0), 0.0, 0.0))
    x, y, z = point_world_m(state.places_mm["N"], (1.0, 0.0, 0.2), facing)
    assert (x, y, z) == pytest.approx((1.0, -0.005, 0.205))
    # Lying on its right shoulder, the owner's left is up in the world.
    lying = compose(facing, rotation((0.0, 0.0, radians(90.0))))
    x, y, z = point_world_m(state.places_mm["N"], (1.0, 0.0, 0.2), lying)
    assert z == pytest.approx(0.205) and abs(y) == pytest.approx(0.005)


# --- A gaze steered over a face: the nearest one, the eyes on the point, and what is refused


REST = (1.5, 0.0, 0.2)
TOP_DOWN: Any = object()
POSE: Any = type("Pose", (), {"p_world_head_m": (0.0, 0.0, 0.1)})()


def face(number: int, x: float, y: float = 0.0, yaw: float = 3.1) -> Face:
    return Face(number, (x, y, 0.2), (0.0, 0.0, 0.0), rotation((yaw, 0.0, 0.0)), (), 0.9)


def steering() -> FaceSteering:
    return FaceSteering(FaceCalibration({}), TOP_DOWN, REST)


def chosen(made: FaceSteering, t_s: float, *faces: Face, captured_s: float | None = None) -> Target:
    seen = Percept(t_s if captured_s is None else captured_s, Bodies(), faces)
    return made.choose(seen, POSE, t_s)


# --- whom it looks at


def test_a_stale_picture_shows_nobody_and_keys_wait():
    made = steering()
    chosen(made, 1.0, face(1, 1.0))
    assert chosen(made, 2.0, face(1, 1.0), captured_s=1.9 - STALE_S).kind == "rest"
    assert "no face is seen" in (made.press("left") or "")
    assert made.state.places_mm == FaceCalibration({}).places_mm and not made.is_aimed
    assert made.press("end") is None and made.state.part is None


# --- what the eyes of an emulated rig do


@pytest.fixture
def steered(desk_rig: Rig) -> FaceSteering:
    return FaceSteering(FaceCalibration({}), TopDown(desk_rig.gaze.top_down), REST)


@pytest.fixture
def made(steered: FaceSteering, desk_rig: Rig) -> Iterator[Run]:
    found = simulated(exact_gaze(desk_rig), "sits-still", 1, chooser=steered)
    yield found
    found.close()


def ticks(made: Run, steered: FaceSteering, seconds: float) -> Tick:
    """Run in simulated time, in which nothing prevents an Enter."""
    start_s, last_s, tick = made.clock.now_s(), made.clock.now_s(), None
    for slot in range(1, int(seconds * 200) + 1):
        made.clock.sleep_until(start_s + slot / 200)
        t_s = made.clock.now_s()
        tick = made.robot.tick(t_s, t_s - last_s)
        steered.update(tick)
        last_s = t_s
    assert tick is not None
    return tick


def test_both_eyes_meet_the_true_place_of_the_part_on_the_face(made: Run, steered: FaceSteering):
    made.robot.start(made.clock)
    (person,) = load_scene("sits-still").people(0.0)
    yaw, pitch = person.face_yaw_pitch_rad
    ticks(made, steered, 1.5)
    for _ in range(3):
        for key in ("left", "up", "up"):
            assert steered.press(key) is None
        part = steered.state.part
        assert part is not None
        true = point_world_m(
            steered.state.places_mm[part], person.p_world_face_m, rotation((yaw, pitch, 0.0))
        )
        pose = ticks(made, steered, 0.6).pose
        left = angle_between(line_of_sight(pose, True), sub(true, pose.p_world_eye_left_m))
        right = angle_between(line_of_sight(pose, False), sub(true, pose.p_world_eye_right_m))
        assert steered.is_aimed and degrees(max(left, right)) < AIMED_DEG
        steered.press("enter")
        ticks(made, steered, 0.1)
        assert part in steered.state.adjusted_parts and steered.state.part != part

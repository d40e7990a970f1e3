"""Keys to offsets in the face's own frame, and back to points in the world."""

from math import dist, radians
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.features.bringup.calibration.face_calibration import (
    FARTHEST_MM,
    ORDER,
    PART_NAMES_TEXT,
    STEPS_MM,
    FaceCalibration,
    Key,
    apply_key,
    changes,
    initial_calibration,
    place_in_face_mm,
    point_world_m,
)
from gazerig.gaze.angles import add, compose, rotate, rotation
from gazerig.gaze.types import PARTS, Angles3, Vec3
from gazerig.robot.model.face_geometry import PARTS_FACE_M

ANGLE = st.floats(-3.1, 3.1)
TURN = st.tuples(ANGLE, st.floats(-1.5, 1.5), ANGLE)
PLACE_M = st.tuples(*3 * (st.floats(-3.0, 3.0),))
KEYS = st.lists(st.sampled_from(get_args(Key)), max_size=60)


def after(*keys: Key, own: dict[str, Vec3] | None = None) -> FaceCalibration:
    state = initial_calibration(own or {})
    for key in keys:
        state = apply_key(state, key)
    return state


@given(KEYS, PLACE_M, TURN, PLACE_M, TURN)
def test_what_was_chosen_on_one_face_is_there_on_the_face_at_any_other_pose(
    keys: list[Key], p_then: Vec3, turn_then: Angles3, p_now: Vec3, turn_now: Angles3
) -> None:
    state = initial_calibration({})
    for key in keys:
        part, place = state.part, state.place_mm(state.part or "N")
        state = apply_key(state, key)
        if key != "enter" or part is None:
            continue
        # Where the gaze met the face as it was then, carried along with the face to now.
        met = point_world_m(place, p_then, rotation(turn_then))
        in_face = place_in_face_mm(met, p_then, rotation(turn_then))
        carried = add(p_now, rotate(rotation(turn_now), tuple(v / 1e3 for v in in_face)))  # type: ignore[arg-type]
        stored = changes(state)[f"face_parts_mm.{part}"]
        found = point_world_m(stored, p_now, rotation(turn_now))
        assert dist(found, carried) < 1e-4  # stored to 0.1 mm


@given(KEYS)
def test_no_keys_lead_off_the_face_or_out_of_its_plane(keys: list[Key]) -> None:
    state = initial_calibration({})
    for key in keys:
        state = apply_key(state, key)
    for part in ORDER:
        x, y, z = state.place_mm(part)
        assert x == pytest.approx(PARTS_FACE_M[part][0] * 1e3)
        assert abs(y) <= FARTHEST_MM and abs(z) <= FARTHEST_MM
    assert state.step_mm in STEPS_MM
    assert {key.partition(".")[2] for key in changes(state)} == set(state.chosen)


def test_every_part_is_asked_for_once_and_named() -> None:
    assert sorted(ORDER) == sorted(PARTS) and set(PART_NAMES_TEXT) == set(PARTS)


def test_left_is_the_owners_left_and_up_is_up_whatever_the_face_does() -> None:
    state = apply_key(apply_key(initial_calibration({}), "left"), "up")
    assert state.moved_mm("N") == (5.0, 5.0)
    # A face that looks back at the robot has its left at the world's -y.
    facing = rotation((radians(180.0), 0.0, 0.0))
    x, y, z = point_world_m(state.place_mm("N"), (1.0, 0.0, 0.2), facing)
    assert (x, y, z) == pytest.approx((1.0, -0.005, 0.205))
    # Lying on its right shoulder, the owner's left is up in the world.
    lying = compose(facing, rotation((0.0, 0.0, radians(90.0))))
    x, y, z = point_world_m(state.place_mm("N"), (1.0, 0.0, 0.2), lying)
    assert z == pytest.approx(0.205) and abs(y) == pytest.approx(0.005)


def test_only_parts_with_an_enter_are_written() -> None:
    state = after("left", "enter", "up", "skip", "down", "enter", "end")
    assert changes(state) == {
        "face_parts_mm.N": (0.0, 5.0, 0.0),
        "face_parts_mm.RE": (-33.0, -30.9, 30.0),
    }
    assert state.part is None and apply_key(state, "left") is state


def test_back_and_skip_take_a_choice_back() -> None:
    state = after("left", "enter", "back", "skip")
    assert changes(state) == {} and state.place_mm("N") == (0.0, 0.0, 0.0)
    state = after("left", "enter", "back", "left", "enter")
    assert changes(state) == {"face_parts_mm.N": (0.0, 10.0, 0.0)}
    assert after("back").part == "N"


def test_a_rigs_own_places_are_where_it_begins() -> None:
    own = {"N": (-4.0, 3.0, 160.0)}
    state = after("up", "right", "enter", own=own)
    # Farther out than keys lead: it stays, and moves only inwards.
    assert changes(state) == {"face_parts_mm.N": (-4.0, -2.0, 160.0)}
    assert after("down", own=own).place_mm("N")[2] == 155.0


def test_steps_end_at_the_largest_and_smallest() -> None:
    assert after(*9 * ("larger",)).step_mm == STEPS_MM[-1]
    assert after(*9 * ("smaller",), "left").moved_mm("N") == (STEPS_MM[0], 0.0)


def test_after_the_last_part_it_has_ended() -> None:
    state = after(*8 * ("enter",))
    assert state.ended and len(changes(state)) == 8

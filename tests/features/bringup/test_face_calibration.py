"""Keys to offsets in the face's own frame, and from there to points in the world."""

from math import pi, radians
from types import SimpleNamespace
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from gazerig.features.bringup.calibration.face_steering import (
    FARTHEST_MM,
    ORDER,
    STALE_S,
    FaceCalibration,
    FaceSteering,
    Key,
    point_world_m,
)
from gazerig.gaze.angles import compose, rotation
from gazerig.gaze.types import Bodies, Face, GazeState, Percept, Target
from gazerig.robot.description.links import IDENTITY
from gazerig.robot.model.face_geometry import PARTS_FACE_M

KEYS = st.lists(st.sampled_from(get_args(Key)), max_size=60)


@given(KEYS)
def test_no_keys_lead_off_the_face_or_out_of_its_plane(keys):
    state = FaceCalibration({})
    for key in keys:
        state.apply(key)
    for part in ORDER:
        x, y, z = state.places_mm[part]
        assert x == pytest.approx(PARTS_FACE_M[part][0] * 1e3)
        assert abs(y) <= FARTHEST_MM and abs(z) <= FARTHEST_MM
    assert {key.partition(".")[2] for key in state.changed_places()} == set(state.adjusted_parts)


def test_left_is_the_owners_left_and_up_is_up_whatever_the_face_does():
    state = FaceCalibration({})
    state.apply("left")
    state.apply("up")
    assert state.places_mm["N"] == (0.0, 5.0, 5.0)
    # A face that looks back at the robot has its left at the world's -y.
    facing = rotation((radians(180.0), 0.0, 0.0))
    p_m = point_world_m(state.places_mm["N"], (1.0, 0.0, 0.2), facing)
    assert p_m == pytest.approx((1.0, -0.005, 0.205))
    # Lying on its right shoulder, the owner's left is up in the world.
    lying = compose(facing, rotation((0.0, 0.0, radians(90.0))))
    p_m = point_world_m(state.places_mm["N"], (1.0, 0.0, 0.2), lying)
    assert p_m == pytest.approx((1.0, 0.005, 0.205))


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


def test_a_face_is_followed_and_its_part_is_the_target_until_it_is_lost():
    made = steering()
    made.state.places_mm["N"] = (0.0, 10.0, -5.0)
    near, far = face(1, 1.0, yaw=pi), face(2, 1.4)
    seen = chosen(made, 1.0, far, near)
    assert (seen.id, seen.part, seen.kind, seen.shift) == (1, "N", "part", 1)
    assert seen.p_world_m == pytest.approx((1.0, -0.01, 0.195))  # the owner's left is -y
    assert seen.centre_world_m == near.p_world_m
    assert chosen(made, 1.1, face(2, 0.6), near).shift == 1
    # A stale picture shows nobody, and keys wait.
    gone = [chosen(made, t_s, near, captured_s=t_s - STALE_S - 0.1) for t_s in (1.2, 6.0, 6.2)]
    assert [one.p_world_m for one in gone] == [seen.p_world_m, seen.p_world_m, REST]
    assert [one.shift for one in gone] == [2, 2, 3]
    assert "no face is seen" in (made.press("left") or "") and not made.is_aimed
    assert chosen(made, 7.0, far).id == 2 and "not taken" in (made.press("enter") or "")
    assert made.press("skip") is None and chosen(made, 7.1, far).part == ORDER[1]
    chosen(made, 8.0)
    assert made.press("end") is None and made.state.part is None


@pytest.mark.parametrize(("aside_m", "aimed"), [(0.017, True), (0.018, False)])
def test_eyes_are_aimed_within_a_degree_of_the_part(aside_m, aimed):
    made = steering()
    target = chosen(made, 1.0, face(1, 1.0))
    pose = GazeState(
        (0.0,) * 3, (0.0,) * 3, (0.0, 0.0), (0.0, 0.0), IDENTITY, *((0.0, 0.0, 0.2),) * 3, 1.0, 1.0
    )
    target = structs.replace(target, p_world_m=(1.0, aside_m, 0.2))
    tick: Any = SimpleNamespace(target=target, pose=pose, gaze=SimpleNamespace(phase="fixate"))
    made.update(tick)
    assert made.is_aimed == aimed

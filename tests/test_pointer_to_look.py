"""The eyes look at a pointer over the view: the point is under the viewer's pointer."""

from math import inf, nan, radians, tan

import pytest
from present import present

from gazerig.gaze.angles import dot, rotate_back, sub, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.dashboard.requests.pointer_to_look import (
    BURST,
    TOWARDS_HEAD,
    Pointer,
    PointerToLook,
    ViewCamera,
    gaze_target,
    parse_pointer,
)
from gazerig.robot.model.clock import SimulatedClock

EYES: Vec3 = (0.03, 0.0, 0.14)
AHEAD_OF_IT = ViewCamera(
    (0.8, 0.0, 0.14),
    ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),  # looks back at the head, upright
    radians(50.0),
)


def turned_camera() -> ViewCamera:
    """A camera aside of the head and above it that has it off its middle."""
    ahead = unit((-0.7, 0.35, -0.2))
    right = unit((ahead[1], -ahead[0], 0.0))
    down = (
        ahead[1] * right[2] - ahead[2] * right[1],
        ahead[2] * right[0] - ahead[0] * right[2],
        ahead[0] * right[1] - ahead[1] * right[0],
    )
    R: Mat3 = tuple(zip(right, down, ahead, strict=True))  # type: ignore[assignment]
    return ViewCamera((0.6, -0.4, 0.3), R, radians(42.0))


def seen_at(point: Vec3, camera: ViewCamera, aspect: float) -> tuple[float, float]:
    """Where in the view a point is drawn, 0..1 from the left and from the top."""
    x, y, z = rotate_back(camera.R_world_camera, sub(point, camera.p_world_m))
    half = tan(0.5 * camera.fov_rad)
    return 0.5 + 0.5 * x / (z * half * aspect), 0.5 + 0.5 * y / (z * half)


@pytest.mark.parametrize("camera", [AHEAD_OF_IT, turned_camera()])
@pytest.mark.parametrize("aspect", [0.9, 1.6])
@pytest.mark.parametrize("at", [(0.5, 0.5), (0.0, 0.0), (1.0, 0.2), (0.3, 1.0)])
def test_the_point_is_drawn_under_the_pointer(
    camera: ViewCamera, aspect: float, at: tuple[float, float]
) -> None:
    point = present(gaze_target(Pointer(*at, aspect), camera, EYES))
    assert seen_at(point, camera, aspect) == pytest.approx(at)
    # All are on one plane, across the line from the viewer to the head.
    to_head = sub(EYES, camera.p_world_m)
    share = dot(sub(point, camera.p_world_m), to_head) / dot(to_head, to_head)
    assert share == pytest.approx(TOWARDS_HEAD)


@pytest.mark.parametrize(
    "asked",
    [
        None, [], "x", 5, {}, {"x": 0.5, "y": 0.5}, {"x": "0.5", "y": 0.5, "aspect": 1},
        {"x": nan, "y": 0.5, "aspect": 1}, {"x": 0.5, "y": 1.1, "aspect": 1},
        {"x": -0.1, "y": 0.5, "aspect": 1}, {"x": 0.5, "y": 0.5, "aspect": 0},
        {"x": 0.5, "y": 0.5, "aspect": inf}, {"x": 0.5, "y": 0.5, "aspect": nan},
    ],
)  # fmt: skip
def test_what_is_no_pointer_is_dropped(asked: object) -> None:
    looks: list[object] = []
    to_look = PointerToLook(
        lambda who: AHEAD_OF_IT, lambda *look: looks.append(look), SimulatedClock()
    )
    to_look.p_world_eyes_m = EYES
    assert not to_look.look_at_pointer(asked, "ana") and looks == []


def test_a_pointer_is_handed_on_with_who_points_and_no_faster_than_a_burst() -> None:
    looks: list[tuple[Vec3, str]] = []
    known = {"ana": AHEAD_OF_IT}
    to_look = PointerToLook(known.get, lambda *look: looks.append(look), SimulatedClock())
    asked = {"x": 0.5, "y": 0.5, "aspect": 1, "more": "is passed over"}
    assert parse_pointer(asked) == Pointer(0.5, 0.5, 1.0)
    assert not to_look.look_at_pointer(asked, "ana")  # the head's place is unknown
    to_look.p_world_eyes_m = EYES
    assert not to_look.look_at_pointer(asked, "bob")  # who does not see the view
    taken = sum(to_look.look_at_pointer(asked, "ana") for _ in range(int(3 * BURST)))
    assert taken == len(looks) == BURST - 1
    assert {who for _, who in looks} == {"ana"}
    assert looks[0][0][0] > EYES[0]

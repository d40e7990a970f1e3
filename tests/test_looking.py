"""Gaze targets of clients: points of two frames, directions, people, pixels; the end of control."""

from collections.abc import Iterator
from math import degrees, radians
from typing import Any

import pytest
from commanded_robot import Running, running_desk

from gazerig.gaze.angles import angle_between, norm, rotate_back, sub, yaw_pitch
from gazerig.robot.model.client_control import ARRIVED_RAD
from gazerig.robot.model.commands import (
    Jog,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
    Stop,
)
from gazerig.robot.model.control_source import NO_CLIENT_CONTROL
from gazerig.robot.model.requests import read_request

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture
def rig() -> Iterator[Running]:
    with running_desk() as running:
        yield running


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"do": "look_at", "p_world_m": None, "for_s": 0}, "> 0.0 - at `.*for_s"),
        ({"do": "look_at_in_head", "p_head_m": None}, "p_head_m"),
        ({"do": "look_at_direction", "direction_rad": [4.0, 0.0]}, "<= 3.14"),
        ({"do": "look_at_direction", "direction_rad": [0.0, 1.7]}, "<= 1.57"),
        ({"do": "look_at_direction", "direction_rad": [0, 0], "distance_m": 0}, "> 0.0"),
        ({"do": "look_at_person", "id": True}, "got `bool`"),
        ({"do": "look_at_pixel", "pixel_px": [1.0]}, "length 2"),
        ({"do": "look_at_pixel", "pixel_px": [1, 2], "captured_s": 10**400}, "out of range"),
    ],
)
def test_what_cannot_be_looked_at_is_refused_with_the_rule(data: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        read_request(data)


def test_a_point_of_the_head_is_where_the_head_had_it(rig: Running) -> None:
    before = rig.go(0.006)[-1].pose
    reply, ticks = rig.do(LookAtInHead((1.2, 0.3, 0.1), stay=True), 1.5)
    assert reply.asked_m is not None
    seen = rotate_back(before.R_world_head, sub(reply.asked_m, before.p_world_head_m))
    assert seen == pytest.approx((1.2, 0.3, 0.1), abs=1e-9)
    # The point stays in the world while the head turns to it.
    assert {tick.target.p_world_m for tick in ticks} == {reply.asked_m}
    assert ticks[-1].client_control.arrived and ticks[-1].client_control.error_rad <= ARRIVED_RAD


@pytest.mark.parametrize("frame", ["world", "head"])
def test_a_direction_is_looked_in(rig: Running, frame: Any) -> None:
    rig.do(Jog((("neck_yaw", radians(15.0)),), stay=True), 2.0)
    before = rig.go(0.006)[-1].pose
    asked = (radians(10.0), radians(-5.0))
    ticks = rig.do(LookAtDirection(asked, frame, stay=True), 2.0)[1]
    pose, point = ticks[-1].pose, ticks[-1].gaze.gaze_point_world_m
    seen = yaw_pitch(sub(point, pose.p_world_head_m))
    if frame == "head":
        seen = yaw_pitch(rotate_back(before.R_world_head, sub(point, pose.p_world_head_m)))
    assert tuple(map(degrees, seen)) == pytest.approx((10.0, -5.0), abs=0.2)
    assert ticks[-1].client_control.arrived


def test_a_person_is_followed_with_the_scanpath_on_the_face(rig: Running) -> None:
    percept = rig.go(0.006)[-1].percept
    assert percept is not None
    person = percept.faces[0].id
    reply, ticks = rig.do(LookAtPerson(person, stay=True), 3.0)
    assert not reply.refused and reply.control_number == 1
    assert {(tick.target.kind, tick.target.id) for tick in ticks} == {("face", person)}
    assert len({tick.target.part for tick in ticks}) > 1
    assert (
        ticks[-1].client_control.arrived
        and ticks[-1].controlled_by == f"a client: look at person {person}"
    )


def test_nobody_is_followed_who_is_not_seen_and_no_longer_than_that(rig: Running) -> None:
    assert rig.do(LookAtPerson(99))[0].refused.startswith("person 99 is not visible; visible: ")
    percept = rig.go(0.006)[-1].percept
    assert percept is not None
    rig.do(LookAtPerson(percept.faces[0].id, stay=True))
    blind: Any = lambda found, poses: None  # noqa: E731
    rig.made.robot.perception.see = blind  # type: ignore[method-assign]
    ticks = rig.go(2.5)
    assert ticks[100].controlled_by and not ticks[-1].controlled_by
    assert ticks[-1].client_control.end_reason == f"person {percept.faces[0].id} is gone"


def test_a_pixel_is_where_it_was_when_the_frame_was_taken(rig: Running) -> None:
    tick = rig.go(0.006)[-1]
    found = tick.detections
    assert found is not None and tick.percept is not None
    x, y, width, height = found.faces[0].box_px
    pixel = (x + width / 2, y + height / 2)
    reply, ticks = rig.do(LookAtPixel(pixel, captured_s=found.captured_s, stay=True), 1.5)
    face = tick.percept.faces[0].p_world_m
    head = tick.pose.p_world_head_m
    assert reply.asked_m is not None
    assert degrees(angle_between(sub(reply.asked_m, head), sub(face, head))) < 2.0
    assert norm(sub(reply.asked_m, head)) == pytest.approx(norm(sub(face, head)), abs=0.1)
    (command,) = ticks[0].commands
    assert isinstance(command, LookAtPixel) and command.p_world_m == reply.asked_m
    assert ticks[-1].client_control.arrived
    near = rig.do(LookAtPixel(pixel, 0.5))[0]
    assert near.asked_m is not None
    assert norm(sub(near.asked_m, head)) == pytest.approx(0.5, abs=0.1)


def test_a_pixel_without_a_frame_is_refused(rig: Running) -> None:
    nothing: Any = lambda now_s: None  # noqa: E731
    rig.made.robot.camera.latest = nothing  # type: ignore[method-assign]
    rig.go(0.006)
    assert "no camera frame" in rig.do(LookAtPixel((1.0, 1.0)))[0].refused


def test_leads_are_counted_and_their_ends_have_reasons(rig: Running) -> None:
    assert rig.go(0.006)[-1].client_control == NO_CLIENT_CONTROL
    assert rig.do(LookAt((1.0, 0.0, 0.3), stay=True))[0].control_number == 1
    reply, ticks = rig.do(LookAt((1.0, 0.4, 0.3), stay=True), 1.5)
    assert (
        reply.control_number == 2
        and ticks[0].client_control.number == 2
        and not ticks[0].client_control.arrived
    )
    assert ticks[-1].client_control.arrived
    free = rig.do(LookAt(None, who="a show"))
    assert (
        free[0].control_number == 0
        and free[1][-1].client_control.end_reason == "a show looks elsewhere"
    )
    reply, ticks = rig.do(Jog((("neck_yaw", radians(20.0)),), stay=True), 0.1)
    assert reply.control_number == 3 and degrees(ticks[0].client_control.error_rad) > 3.0
    assert rig.go(2.0)[-1].client_control.arrived
    assert rig.do(Stop("a hand"))[1][-1].client_control.end_reason == "stopped: a hand"

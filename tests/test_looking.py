"""Gaze targets of clients: points of two frames, directions, people, pixels; the end of control."""

from math import degrees, radians
from typing import Any

import pytest
from commanded_robot import Running

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

pytestmark = pytest.mark.usefixtures("ideal_servos")


def test_a_point_of_the_head_is_where_the_head_had_it(running: Running) -> None:
    before = running.go(0.006)[-1].pose
    reply, ticks = running.do(LookAtInHead((1.2, 0.3, 0.1), stay=True), 1.5)
    assert reply.asked_m is not None
    seen = rotate_back(before.R_world_head, sub(reply.asked_m, before.p_world_head_m))
    assert seen == pytest.approx((1.2, 0.3, 0.1), abs=1e-9)
    # The point stays in the world while the head turns to it.
    assert {tick.target.p_world_m for tick in ticks} == {reply.asked_m}
    assert ticks[-1].client_control.arrived and ticks[-1].client_control.error_rad <= ARRIVED_RAD


@pytest.mark.parametrize("frame", ["world", "head"])
def test_a_direction_is_looked_in(running: Running, frame: Any) -> None:
    running.do(Jog((("neck_yaw", radians(15.0)),), stay=True), 2.0)
    before = running.go(0.006)[-1].pose
    asked = (radians(10.0), radians(-5.0))
    ticks = running.do(LookAtDirection(asked, frame, stay=True), 2.0)[1]
    pose, point = ticks[-1].pose, ticks[-1].gaze.gaze_point_world_m
    seen = yaw_pitch(sub(point, pose.p_world_head_m))
    if frame == "head":
        seen = yaw_pitch(rotate_back(before.R_world_head, sub(point, pose.p_world_head_m)))
    assert tuple(map(degrees, seen)) == pytest.approx((10.0, -5.0), abs=0.2)
    assert ticks[-1].client_control.arrived


def test_a_person_is_followed_with_the_scanpath_on_the_face(running: Running) -> None:
    percept = running.go(0.006)[-1].percept
    assert percept is not None
    person = percept.faces[0].id
    reply, ticks = running.do(LookAtPerson(person, stay=True), 3.0)
    assert not reply.refused and reply.control_number == 1
    assert {(tick.target.kind, tick.target.id) for tick in ticks} == {("face", person)}
    assert len({tick.target.part for tick in ticks}) > 1
    assert (
        ticks[-1].client_control.arrived
        and ticks[-1].controlled_by == f"a client: look at person {person}"
    )


def test_nobody_is_followed_who_is_not_seen_and_no_longer_than_that(running: Running) -> None:
    assert running.do(LookAtPerson(99))[0].refused.startswith("person 99 is not visible; visible: ")
    percept = running.go(0.006)[-1].percept
    assert percept is not None
    running.do(LookAtPerson(percept.faces[0].id, stay=True))
    blind: Any = lambda found, poses: None  # noqa: E731
    running.made.robot.perception.see = blind  # type: ignore[method-assign]
    ticks = running.go(2.5)
    assert ticks[100].controlled_by and not ticks[-1].controlled_by
    assert ticks[-1].client_control.end_reason == f"person {percept.faces[0].id} is gone"


def test_a_pixel_is_where_it_was_when_the_frame_was_taken(running: Running) -> None:
    tick = running.go(0.006)[-1]
    found = tick.detections
    assert found is not None and tick.percept is not None
    x, y, width, height = found.faces[0].box_px
    pixel = (x + width / 2, y + height / 2)
    reply, ticks = running.do(LookAtPixel(pixel, captured_s=found.captured_s, stay=True), 1.5)
    face = tick.percept.faces[0].p_world_m
    head = tick.pose.p_world_head_m
    assert reply.asked_m is not None
    assert degrees(angle_between(sub(reply.asked_m, head), sub(face, head))) < 2.0
    assert norm(sub(reply.asked_m, head)) == pytest.approx(norm(sub(face, head)), abs=0.1)
    (command,) = ticks[0].commands
    assert isinstance(command, LookAtPixel) and command.p_world_m == reply.asked_m
    assert ticks[-1].client_control.arrived
    near = running.do(LookAtPixel(pixel, 0.5))[0]
    assert near.asked_m is not None
    assert norm(sub(near.asked_m, head)) == pytest.approx(0.5, abs=0.1)


def test_a_pixel_without_a_frame_is_refused(running: Running) -> None:
    nothing: Any = lambda now_s: None  # noqa: E731
    running.made.robot.camera.latest = nothing  # type: ignore[method-assign]
    running.go(0.006)
    assert "no camera frame" in running.do(LookAtPixel((1.0, 1.0)))[0].refused


def test_leads_are_counted_and_their_ends_have_reasons(running: Running) -> None:
    assert running.go(0.006)[-1].client_control == NO_CLIENT_CONTROL
    assert running.do(LookAt((1.0, 0.0, 0.3), stay=True))[0].control_number == 1
    reply, ticks = running.do(LookAt((1.0, 0.4, 0.3), stay=True), 1.5)
    assert (
        reply.control_number == 2
        and ticks[0].client_control.number == 2
        and not ticks[0].client_control.arrived
    )
    assert ticks[-1].client_control.arrived
    free = running.do(LookAt(None, who="a show"))
    assert (
        free[0].control_number == 0
        and free[1][-1].client_control.end_reason == "a show looks elsewhere"
    )
    reply, ticks = running.do(Jog((("neck_yaw", radians(20.0)),), stay=True), 0.1)
    assert reply.control_number == 3 and degrees(ticks[0].client_control.error_rad) > 3.0
    assert running.go(2.0)[-1].client_control.arrived
    assert running.do(Stop("a hand"))[1][-1].client_control.end_reason == "stopped: a hand"

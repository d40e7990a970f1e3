"""Commands to a running robot: checked, executed at the next tick, and safe."""

from math import degrees, nan, pi, radians
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import yaml
from commanded_robot import ONE_TICK_S, YAW, Running
from fakes.runs import go

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between, norm, rotate_back, sub, yaw_pitch
from gazerig.gaze.types import Floats
from gazerig.robot.loop.power_down import Interrupts
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import (
    AnyCommand,
    Ask,
    Command,
    Jog,
    LookAt,
    LookAtDirection,
    LookAtPerson,
    LookAtPixel,
    Renew,
    Resume,
    Say,
    SetLevel,
    Stop,
    Talk,
    Tune,
    check_command,
    read_request,
)
from gazerig.robot.run.session import prepare_shutdown

pytestmark = pytest.mark.usefixtures("ideal_servos")
GENTLE_RAD_S = radians(load_rig("desk").guard.soft_start_speed_deg_s)


ORDERS: list[Command] = [
    Ask("lids", "wink left"),
    LookAt((1.0, 0.2, 0.3)),
    LookAt(None),
    Jog((("neck_yaw", 0.2), ("left_eye_pan", -0.1))),
    Jog(()),
    Renew(who="a program"),
    Stop("a hand"),
    Stop("a hand", who="browser 3"),
    Resume(),
    Resume(who="browser 3", confirmed=True),
    Tune((("loop.rate_hz", 100.0), ("gaze.saccade.profile", "min_jerk"), ("x", (1, 2)))),
]


@pytest.mark.parametrize("order", ORDERS, ids=str)
def test_orders_cross_processes_and_recordings_as_they_are(order):
    plain = msgspec.json.decode(msgspec.json.encode(order))
    assert check_command(msgspec.convert(plain, AnyCommand)) == check_command(order) == order
    assert isinstance(order, Tune) or read_request(plain) == order


REFUSED = yaml.safe_load(
    (Path(__file__).parents[3] / "tests" / "golden" / "refused_requests.yaml").read_text()
)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        *REFUSED,
        ({"do": "jog", "angles_rad": [["neck_yaw", 0.0]] * 99}, "length <= 64"),
        ({"do": "stop", "why": "x" * 999}, "length <= 200 - at `.*why`"),
        ({"do": "look_at_person", "id": 10**30}, "out of range|<= 9007199254740992"),
        ({"do": "look_at_pixel", "pixel_px": [1, 2], "captured_s": 10**400}, "out of range"),
        ({"do": "find", "sought": "anybdy"}, r"mean 'anybody'\?; find has sought \(left, right"),
    ],
)
def test_what_is_no_order_is_refused_with_place_and_rule(data, words):
    with pytest.raises(ValueError, match=words):
        read_request(data)


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (LookAt((1.0, 0.0, 0.3), for_s=nan), "look_at: Expected `float` > 0.0 - at `.for_s`"),
        (SetLevel("mouth", nan), "set_level: Expected `float` >= 0.0"),
        (Stop("\ud800"), "surrogates not allowed"),
        (Talk("listening", text="hello"), "belong to speaking"),
        (Say(" \n"), "a text without a word is no speech"),
    ],
)
def test_an_invalid_order_of_this_program_is_refused(order, words):
    with pytest.raises(ValueError, match=words.replace("`.", r"`\$.")):
        check_command(order)


def fastest_rad_s(ticks: list[Tick]) -> Floats:
    """Return the highest commanded speed of each joint."""
    angles = np.array([tick.guard_result.command_rad for tick in ticks])
    times = np.array([tick.t_s for tick in ticks])
    speeds: Floats = np.abs(np.diff(angles, axis=0)) / np.diff(times)[:, None]
    return speeds.max(axis=0)


def test_a_stop_takes_the_torque_off_within_one_tick_and_nothing_moves_after(running):
    running.order(Stop("the space bar"))
    ticks = running.go(1.0)
    first = ticks[0]
    assert first.commands == (Stop("the space bar"),) and first.stopped == "the space bar"
    assert not any(ticks[1].joints.torque)
    assert {tick.guard_result.level for tick in ticks} == {"torque_off"}
    assert first.guard_result.reasons == ("all: stopped (the space bar)",)
    assert any("torque off" in event for event in first.events)
    later = [tick.joints.position_rad for tick in ticks[20:]]
    assert max(abs(a - b) for p in later for a, b in zip(p, later[0], strict=True)) < 0.02
    # The program goes on: people can see, and resume.
    assert running.count.stopped_by == "over"


def test_resume_goes_on_slowly_from_where_the_joints_are(running):
    running.order(Resume())  # of nothing
    running.order(Stop("test"))
    before = running.go(2.0)[-1]
    assert not any("torque on" in event for tick in running.ticks for event in tick.events)
    running.order(Resume())
    ticks = running.go(3.0)
    assert not ticks[0].stopped and all(ticks[2].joints.torque)
    start = ticks[0].guard_result.command_rad
    assert start == pytest.approx(before.joints.position_rad, abs=radians(0.5))
    assert fastest_rad_s(ticks[:100]).max() <= GENTLE_RAD_S * 1.01
    assert ticks[-1].guard_result.level in ("ok", "limited")
    assert ticks[-1].target.kind == "face"


def test_a_run_that_ends_stopped_does_not_park(running):
    running.order(Stop("test"))
    running.go(0.2)
    said: list[str] = []
    end = prepare_shutdown(running.made, said.append, Interrupts())
    end.cause = running.count.stopped_by
    end.shut_down()
    assert said == ["stopped by over: not parked, as it was stopped, torque off"]


def test_a_stop_while_parking_is_obeyed_at_once(running):
    robot, made = running.made.robot, running.made
    robot.command(Jog((("neck_yaw", radians(50.0)),), stay=True))
    running.go(2.0)
    began_s = made.clock.now_s()
    robot.command(LookAt(None))
    robot.command(Stop("a hand"))
    seen: list[Tick] = []
    assert not robot.park(made.park_rad, made.clock, made.loop, watch=seen.append)
    assert [tick.stopped for tick in seen] == ["a hand"]
    assert made.clock.now_s() - began_s < 0.011
    joints = robot.body.read(made.clock.now_s())
    assert not any(joints.torque) and degrees(joints.position_rad[YAW]) > 45.0


def test_a_jogged_joint_goes_there_slowly_while_the_others_hold(running):
    held = running.ticks[-1].guard_result.command_rad
    running.order(Jog((("neck_yaw", radians(25.0)),), stay=True))
    ticks = running.go(2.0)
    end = ticks[-1].guard_result.command_rad
    assert degrees(end[YAW]) == pytest.approx(25.0, abs=0.1)
    assert all(
        abs(a - b) < 1e-3 for i, (a, b) in enumerate(zip(end, held, strict=True)) if i != YAW
    )
    assert fastest_rad_s(ticks)[YAW] <= GENTLE_RAD_S * 1.01
    running.order(Jog(()))
    assert running.go(2.0)[-1].target.kind == "face"


def test_a_jog_beyond_the_end_is_refused_with_the_joints_range(running):
    with pytest.raises(ValueError, match=r"neck_yaw 180.0 deg is outside its range, -70..70 deg"):
        running.order(Jog((("neck_yaw", pi),)))
    running.order(Jog((("neck_yaw", radians(70.04)),)))  # a slider's rounding
    assert running.go(0.1)[0].controlled_by == "a client: neck_yaw at 70.0 deg"


def test_unknown_menus_are_refused_when_asked(running):
    with pytest.raises(ValueError, match="available: behaviour, conversation, lids"):
        running.order(Ask("mood", "x"))
    with pytest.raises(ValueError, match="available: wink left"):
        running.order(Ask("lids", "x"))


# Clients that may resume, and the time


def replied(running: Running, order: Command) -> str:
    """Ask, run on, and give why it was refused."""
    return running.do(order)[0].refused


def test_a_command_is_replied_to_when_its_tick_can_be_seen(running):
    robot = running.made.robot
    orders: tuple[list[Command], ...] = (
        [Stop("a hand")],
        [LookAt((1.0, 0.2, 0.3)), Stop("again")],
    )
    for commands in orders:
        tickets = [robot.command(command) for command in commands]
        seen = []

        def watch(tick: Tick) -> None:
            seen.append([ticket.wait(0.0) for ticket in tickets])  # noqa: B023

        go(running.made, ONE_TICK_S, watch)
        assert seen[0] == [None] * len(tickets)
        assert None not in [ticket.wait(0.0) for ticket in tickets]


def test_what_was_asked_for_before_a_stop_does_not_move_the_head_after(running):
    tickets = [
        running.made.robot.command(order)
        for order in (LookAt((1.0, 0.2, 0.3)), Jog((("neck_yaw", 0.2),)), Resume(confirmed=True))
    ]
    running.order(Stop("a hand"))
    assert running.go()[0].commands == (Stop("a hand"),)
    replies = [ticket.wait(0.0) for ticket in tickets]
    assert all(reply is not None and "stopped meanwhile" in reply.refused for reply in replies)
    assert "resume first" in replied(running, LookAt((1.0, 0.2, 0.3)))


# The client in control, and the duration


def test_a_lead_that_nobody_renews_lapses_and_is_named(running):
    running.order(Jog((("neck_yaw", 0.3),), who="a show (process 7)"))
    ticks = running.go(1.5)
    assert ticks[0].controlled_by == "a show (process 7): neck_yaw at 17.2 deg"
    led = [tick for tick in ticks if tick.controlled_by]
    assert led[-1].t_s - led[0].t_s == pytest.approx(1.0, abs=0.011)
    words = [event for tick in ticks for event in tick.events]
    assert "controlled by a show (process 7): neck_yaw at 17.2 deg" in words
    assert (
        "a show (process 7): neck_yaw at 17.2 deg: not renewed, so the gaze models are in control again"
        in words
    )
    assert fastest_rad_s(ticks)[YAW] <= GENTLE_RAD_S * 1.01


# Floods


def test_orders_that_wait_are_bounded_and_a_stop_goes_before_them(running):
    robot = running.made.robot
    with pytest.raises(ValueError, match="too many requests"):
        for _ in range(1000):
            robot.command(Ask("lids", "wink left"))
    stop = robot.command(Stop("a hand"))
    tick = running.go()[0]
    assert tick.commands[0] == Stop("a hand") and len(tick.commands) <= 9
    assert stop.wait(0.0) is not None and tick.stopped
    for _ in range(1000):
        robot.command(Stop("again"))
    assert len(robot._commands) <= 128


# ---- Gaze targets of clients: points of two frames, directions, people, pixels; the end


@pytest.mark.parametrize("frame", ["world", "head"])
def test_a_direction_is_looked_in(running, frame):
    running.do(Jog((("neck_yaw", radians(15.0)),), stay=True), 2.0)
    before = running.go()[-1].pose
    asked = (radians(10.0), radians(-5.0))
    ticks = running.do(LookAtDirection(asked, frame, stay=True), 2.0)[1]
    pose, point = ticks[-1].pose, ticks[-1].gaze.gaze_point_world_m
    seen = yaw_pitch(sub(point, pose.p_world_head_m))
    if frame == "head":
        seen = yaw_pitch(rotate_back(before.R_world_head, sub(point, pose.p_world_head_m)))
    assert tuple(map(degrees, seen)) == pytest.approx((10.0, -5.0), abs=0.2)
    assert ticks[-1].client_control.arrived


def test_nobody_is_followed_who_is_not_seen(running):
    assert running.do(LookAtPerson(99))[0].refused.startswith("no visible person '99'; available: ")


def test_a_pixel_is_where_it_was_when_the_frame_was_taken(running):
    tick = running.go()[-1]
    found = tick.detections
    assert found is not None and tick.percept is not None
    x, y, width, height = found.faces[0].box_px
    pixel = (x + width / 2, y + height / 2)
    ticks = running.do(LookAtPixel(pixel, captured_s=found.captured_s, stay=True), 1.5)[1]
    face = tick.percept.faces[0].p_world_m
    head = tick.pose.p_world_head_m
    (command,) = ticks[0].commands
    point = ticks[0].target.p_world_m
    assert isinstance(command, LookAtPixel) and command.p_world_m == point
    assert degrees(angle_between(sub(point, head), sub(face, head))) < 2.0
    assert norm(sub(point, head)) == pytest.approx(norm(sub(face, head)), abs=0.1)
    assert ticks[-1].client_control.arrived
    near = running.do(LookAtPixel(pixel, 0.5))[1][0].target.p_world_m
    assert norm(sub(near, head)) == pytest.approx(0.5, abs=0.1)


def test_a_pixel_without_a_frame_is_refused(running):
    nothing: Any = lambda now_s: None  # noqa: E731
    running.made.robot.camera.latest = nothing
    running.go()
    assert "no camera frame" in running.do(LookAtPixel((1.0, 1.0)))[0].refused

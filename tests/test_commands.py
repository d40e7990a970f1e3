"""Commands to a running robot: checked, executed at the next tick, and safe."""

from math import degrees, inf, nan, pi, radians

import msgspec
import pytest
from commanded_robot import YAW, Running

from gazerig.config.schema import load_rig
from gazerig.robot.app.session import shut_down
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import (
    AnyCommand,
    Ask,
    Command,
    Jog,
    LookAt,
    Renew,
    Resume,
    Say,
    SetLevel,
    Stop,
    Talk,
    Tune,
    check_command,
)
from gazerig.robot.model.requests import read_request

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
def test_orders_cross_processes_and_recordings_as_they_are(order: Command) -> None:
    plain = msgspec.json.decode(msgspec.json.encode(order))
    assert check_command(msgspec.convert(plain, AnyCommand)) == check_command(order) == order
    assert isinstance(order, Tune) or read_request(plain) == order


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (None, "available: hello, .*, look_at"),
        ({"do": "dance"}, "available: hello, .*, look_at"),
        ({"do": "ask", "menu": "lids", "choice": "a", "x": 1}, "`x`; ask has menu, choice"),
        ({"do": "look_at_direction", "direction_rad": [0, 0], "frame": "x"}, r"\(world, head\)"),
        ({"do": "jog", "angles_rad": [["neck_yaw", 7.0]]}, r"<= 6.28.* - at `\$.angles_rad\[0\]"),
        ({"do": "jog", "angles_rad": [["neck_yaw", 0.0]] * 99}, "length <= 64"),
        ({"do": "stop", "why": "x" * 999}, "length <= 200 - at `.*why`"),
        ({"do": "resume", "confirmed": "yes"}, "Expected `bool`"),
        ({"do": "look_at", "p_world_m": [1.0, 2.0]}, "length 3"),
        ({"do": "look_at", "p_world_m": [1.0, nan, 2.0]}, ">= -1000.0"),
        ({"do": "jog", "angles_rad": [["neck_yaw", inf]]}, "<= 6.28"),
        ({"do": "look_at_person", "id": 10**30}, "out of range|<= 9007199254740992"),
        ({"do": "opponent", "p_world_m": [2.0, 0.0, 0.0]}, "<= 1.2"),
        ({"do": "tune", "changes": [["a", 1]]}, "request"),
        ({"do": "look_at", "p_world_m": None, "for_s": 0}, "> 0.0 - at `.*for_s"),
        ({"do": "look_at_in_head", "p_head_m": None}, "p_head_m"),
        ({"do": "look_at_direction", "direction_rad": [4.0, 0.0]}, "<= 3.14"),
        ({"do": "look_at_direction", "direction_rad": [0.0, 1.7]}, "<= 1.57"),
        ({"do": "look_at_direction", "direction_rad": [0, 0], "distance_m": 0}, "> 0.0"),
        ({"do": "look_at_person", "id": True}, "got `bool`"),
        ({"do": "look_at_pixel", "pixel_px": [1.0]}, "length 2"),
        ({"do": "look_at_pixel", "pixel_px": [1, 2], "captured_s": 10**400}, "out of range"),
        (
            {"do": "talk", "state": "talking"},
            "talk has state .listening, thinking, speaking, idle, interrupt.",
        ),
        ({"do": "talk"}, "missing required field `state`"),
        ({"do": "talk", "state": "listening", "person": -1}, ">= 0 - at `.*person`"),
        ({"do": "talk", "state": "speaking", "seconds": 0}, "> 0.0 - at `.*seconds`"),
        ({"do": "talk", "state": "speaking", "seconds": 3600}, "<= 600.0"),
        ({"do": "talk", "state": "speaking", "words": [["a", nan]]}, "at `.*words"),
    ],
)
def test_what_is_no_order_is_refused_with_place_and_rule(data: object, words: str) -> None:
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
def test_an_invalid_order_of_this_program_is_refused(order: Command, words: str) -> None:
    with pytest.raises(ValueError, match=words.replace("`.", r"`\$.")):
        check_command(order)


def test_a_stop_takes_the_torque_off_within_one_tick_and_nothing_moves_after(
    running: Running,
) -> None:
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
    assert running.count.stopped_by == "seconds"


def test_resume_goes_on_slowly_from_where_the_joints_are(running: Running) -> None:
    running.order(Stop("test"))
    before = running.go(2.0)[-1]
    running.order(Resume())
    ticks = running.go(3.0)
    assert not ticks[0].stopped and all(ticks[2].joints.torque)
    start = ticks[0].guard_result.command_rad
    assert start == pytest.approx(before.joints.position_rad, abs=radians(0.5))
    for a, b in zip(ticks, ticks[1:100], strict=False):
        for old, new in zip(a.guard_result.command_rad, b.guard_result.command_rad, strict=True):
            assert abs(new - old) <= GENTLE_RAD_S * (b.t_s - a.t_s) * 1.01 + 1e-9
    assert ticks[-1].guard_result.level in ("ok", "limited")
    assert ticks[-1].target.kind == "face"


def test_a_run_that_ends_stopped_does_not_park(running: Running) -> None:
    running.order(Stop("test"))
    running.go(0.2)
    said: list[str] = []
    shut_down(running.made, running.count, said.append)
    assert said == ["stopped by seconds: not parked, as it was stopped, torque off"]


def test_a_stop_while_parking_is_obeyed_at_once(running: Running) -> None:
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


def test_two_stops_are_one_and_a_resume_of_nothing_is_nothing(running: Running) -> None:
    running.order(Resume())
    assert not any("torque" in e for tick in running.go(0.1) for e in tick.events)
    running.order(Stop("one"))
    running.order(Stop("two"))
    tick = running.go(0.1)[0]
    assert sum("stopped" in event for event in tick.events) == 1


def test_a_jogged_joint_goes_there_slowly_while_the_others_hold(running: Running) -> None:
    held = running.ticks[-1].guard_result.command_rad
    running.order(Jog((("neck_yaw", radians(25.0)),), stay=True))
    ticks = running.go(2.0)
    end = ticks[-1].guard_result.command_rad
    assert degrees(end[YAW]) == pytest.approx(25.0, abs=0.1)
    assert all(
        abs(a - b) < 1e-3 for i, (a, b) in enumerate(zip(end, held, strict=True)) if i != YAW
    )
    steps = [
        abs(b.guard_result.command_rad[YAW] - a.guard_result.command_rad[YAW]) / (b.t_s - a.t_s)
        for a, b in zip(ticks, ticks[1:], strict=False)
    ]
    assert max(steps) <= GENTLE_RAD_S * 1.01
    running.order(Jog(()))
    assert running.go(2.0)[-1].target.kind == "face"


def test_a_jog_beyond_the_end_is_refused_with_the_joints_range(running: Running) -> None:
    with pytest.raises(ValueError, match=r"neck_yaw 180.0 deg is outside its range, -70..70 deg"):
        running.order(Jog((("neck_yaw", pi),)))
    running.order(Jog((("neck_yaw", radians(70.04)),)))  # a slider's rounding
    assert running.go(0.1)[0].controlled_by == "a client: jog neck_yaw 70.0"


def test_unknown_menus_are_refused_when_asked(running: Running) -> None:
    with pytest.raises(ValueError, match="available: behaviour, conversation, lids"):
        running.order(Ask("mood", "x"))
    with pytest.raises(ValueError, match="available: wink left"):
        running.order(Ask("lids", "x"))


# Clients that may resume, and the time


def replied(running: Running, order: Command, seconds: float = 0.006) -> str:
    """Ask, run on, and give why it was refused."""
    ticket = running.made.robot.command(order)
    running.go(seconds)
    reply = ticket.wait(0.0)
    assert reply is not None
    return reply.refused


def test_a_stop_holds_two_seconds_whoever_asks(running: Running) -> None:
    running.order(Stop("a hand", who="browser 1"))
    running.go(0.5)
    assert "lasts at least 2 s: try again in 1.5 s" in replied(
        running, Resume(who="browser 1", confirmed=True)
    )
    running.go(1.6)
    assert replied(running, Resume(who="browser 1")) == "" and not running.made.robot.stopped


def test_another_resumes_only_who_confirms(running: Running) -> None:
    for who in ("browser 1", "browser 2"):
        running.order(Stop("a hand", who=who))
    running.go(2.1)
    by = "stopped by browser 1 and browser 2: another client must confirm"
    for command in (Resume(who="browser 2"), Resume()):
        assert by in replied(running, command)
    assert running.made.robot.stopped
    ticket = running.made.robot.command(Resume(who="browser 2", confirmed=True))
    tick = running.go(0.006)[0]
    assert ticket.wait(0.0) is not None and not tick.stopped
    assert any("torque on again by browser 2" in event for event in tick.events)


@pytest.mark.parametrize("confirmed", [False, True])
def test_a_flood_of_resumes_beats_no_stop(running: Running, confirmed: bool) -> None:
    running.order(Stop("a hand", who="browser 1"))
    events: list[str] = []
    for _ in range(700):  # 3.5 s, one a tick
        running.order(Resume(who="a loop", confirmed=confirmed))
        events += [event for tick in running.go(0.006) for event in tick.events]
    assert running.made.robot.stopped == "a hand"
    assert len([event for event in events if "resume" in event]) < 10


def test_a_command_is_replied_to_when_its_tick_can_be_seen(running: Running) -> None:
    robot, made = running.made.robot, running.made
    orders: tuple[list[Command], ...] = (
        [Stop("a hand")],
        [LookAt((1.0, 0.2, 0.3)), Stop("again")],
    )
    for commands in orders:
        tickets = [robot.command(command) for command in commands]
        seen = []

        def watch(tick: Tick) -> None:
            seen.append([ticket.wait(0.0) for ticket in tickets])  # noqa: B023

        run(robot, made.clock, made.loop, lambda s: "s" if s >= 0.006 else None, watch)
        assert seen[0] == [None] * len(tickets)
        assert None not in [ticket.wait(0.0) for ticket in tickets]


def test_what_was_asked_for_before_a_stop_does_not_move_the_head_after(running: Running) -> None:
    tickets = [
        running.made.robot.command(order)
        for order in (LookAt((1.0, 0.2, 0.3)), Jog((("neck_yaw", 0.2),)), Resume(confirmed=True))
    ]
    running.order(Stop("a hand"))
    assert running.go(0.006)[0].commands == (Stop("a hand"),)
    replies = [ticket.wait(0.0) for ticket in tickets]
    assert all(reply is not None and "stopped meanwhile" in reply.refused for reply in replies)
    assert "resume first" in replied(running, LookAt((1.0, 0.2, 0.3)))


# The client in control, and the duration


def test_a_lead_that_nobody_renews_lapses_and_is_named(running: Running) -> None:
    running.order(Jog((("neck_yaw", 0.3),), who="a show (process 7)"))
    ticks = running.go(1.5)
    assert ticks[0].controlled_by == "a show (process 7): jog neck_yaw 17.2"
    led = [tick for tick in ticks if tick.controlled_by]
    assert led[-1].t_s - led[0].t_s == pytest.approx(1.0, abs=0.011)
    words = [event for tick in ticks for event in tick.events]
    assert "controlled by a show (process 7): jog neck_yaw 17.2" in words
    assert (
        "a show (process 7): jog neck_yaw 17.2: not renewed, so the gaze models are in control again"
        in words
    )
    yaw = [tick.guard_result.command_rad[YAW] for tick in ticks]
    assert (
        max(abs(b - a) for a, b in zip(yaw, yaw[1:], strict=False)) <= GENTLE_RAD_S * 0.005 * 1.01
    )


def test_a_lead_holds_while_it_is_renewed_by_the_one_who_leads(running: Running) -> None:
    running.order(LookAt((1.2, 0.6, 0.3), who="a show"))
    for _ in range(5):
        running.go(0.5)
        assert replied(running, Renew(who="a show")) == ""
    assert running.ticks[-1].controlled_by == "a show: look at 1.2 0.6 0.3"
    for _ in range(4):
        assert "no longer control" in replied(running, Renew(who="another"))
        running.go(0.4)
    assert running.ticks[-1].controlled_by == "" and running.ticks[-1].target.kind == "face"


# Floods


def test_orders_that_wait_are_bounded_and_a_stop_goes_before_them(running: Running) -> None:
    robot = running.made.robot
    with pytest.raises(ValueError, match="too many requests"):
        for _ in range(1000):
            robot.command(Ask("lids", "wink left"))
    stop = robot.command(Stop("a hand"))
    tick = running.go(0.006)[0]
    assert tick.commands[0] == Stop("a hand") and len(tick.commands) <= 9
    assert stop.wait(0.0) is not None and tick.stopped
    for _ in range(1000):
        robot.command(Stop("again"))
    assert len(robot._commands) <= 128

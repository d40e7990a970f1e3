"""Who may end a stop, and who leads the head for how long."""

from collections.abc import Iterator
from math import radians

import pytest
from commanded_robot import YAW, Running, running_desk

from gazerig.config.schema import load_rig
from gazerig.robot.model.commands import Ask, Command, Jog, LookAt, Renew, Resume, Stop

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture
def running() -> Iterator[Running]:
    with running_desk() as running:
        yield running


# Who may resume, and when


def replied(running: Running, order: Command, seconds: float = 0.006) -> str:
    """Ask, run on, and give why it was refused."""
    ticket = running.made.robot.command(order)
    running.go(seconds)
    reply = ticket.wait(0.0)
    assert reply is not None
    return reply.refused


def test_a_stop_holds_two_seconds_whoever_asks(running: Running) -> None:
    running.order(Stop("a hand", "browser 1"))
    running.go(0.5)
    assert "holds at least 2 s: ask again in 1.5 s" in replied(running, Resume("browser 1", True))
    running.go(1.6)
    assert replied(running, Resume("browser 1")) == "" and not running.made.robot.stopped


def test_another_resumes_only_who_confirms(running: Running) -> None:
    running.order(Stop("a hand", "browser 1"))
    running.go(2.1)
    assert "stopped by browser 1: another may only" in replied(running, Resume("browser 2"))
    assert "stopped by browser 1: another may only" in replied(running, Resume())
    assert running.made.robot.stopped
    ticket = running.made.robot.command(Resume("browser 2", confirmed=True))
    tick = running.go(0.006)[0]
    assert ticket.wait(0.0) is not None and not tick.stopped
    assert any("torque on again by browser 2" in event for event in tick.events)


def test_a_second_stop_is_anothers_too_and_holds_anew(running: Running) -> None:
    running.order(Stop("a hand", "browser 1"))
    running.go(1.5)
    running.order(Stop("mine too", "browser 2"))
    running.go(1.0)
    assert "at least 2 s" in replied(running, Resume("browser 1"))
    running.go(1.1)
    assert "browser 1 and browser 2" in replied(running, Resume("browser 1"))


@pytest.mark.parametrize("confirmed", [False, True])
def test_a_flood_of_resumes_beats_no_stop(running: Running, confirmed: bool) -> None:
    running.order(Stop("a hand", "browser 1"))
    events: list[str] = []
    for _ in range(700):  # 3.5 s, one a tick
        running.order(Resume("a loop", confirmed))
        events += [event for tick in running.go(0.006) for event in tick.events]
    assert running.made.robot.stopped == "a hand"
    assert len([event for event in events if "resume" in event]) < 10


def test_what_was_asked_for_before_a_stop_does_not_move_the_head_after(running: Running) -> None:
    tickets = [
        running.made.robot.command(order)
        for order in (LookAt((1.0, 0.2, 0.3)), Jog((("neck_yaw", 0.2),)), Resume(confirmed=True))
    ]
    running.order(Stop("a hand"))
    assert running.go(0.006)[0].commands == (Stop("a hand"),)
    replies = [ticket.wait(0.0) for ticket in tickets]
    assert all(reply is not None and "stopped since" in reply.refused for reply in replies)
    assert "resume first" in replied(running, LookAt((1.0, 0.2, 0.3)))


# Who leads, and for how long


def test_a_lead_that_nobody_renews_lapses_and_is_named(running: Running) -> None:
    running.order(Jog((("neck_yaw", 0.3),), "a show (process 7)"))
    ticks = running.go(1.5)
    assert ticks[0].led == "a show (process 7): jog neck_yaw 17.2"
    led = [tick for tick in ticks if tick.led]
    assert led[-1].t_s - led[0].t_s == pytest.approx(1.0, abs=0.011)
    words = [event for tick in ticks for event in tick.events]
    assert "led by a show (process 7): jog neck_yaw 17.2" in words
    assert "a show (process 7): jog neck_yaw 17.2: not renewed, so the gaze leads again" in words
    gentle = radians(load_rig("desk").guard.soft_start_speed_deg_s)
    yaw = [tick.guard_result.command_rad[YAW] for tick in ticks]
    assert max(abs(b - a) for a, b in zip(yaw, yaw[1:], strict=False)) <= gentle * 0.005 * 1.01


def test_a_lead_holds_while_it_is_renewed_by_the_one_who_leads(running: Running) -> None:
    running.order(LookAt((1.2, 0.6, 0.3), "a show"))
    for _ in range(5):
        running.go(0.5)
        assert replied(running, Renew("a show")) == ""
    assert running.ticks[-1].led == "a show: look at 1.2 0.6 0.3"
    for _ in range(4):
        assert "lead nothing" in replied(running, Renew("another"))
        running.go(0.4)
    assert running.ticks[-1].led == "" and running.ticks[-1].target.kind == "face"


def test_a_lead_that_is_to_stay_stays_until_it_is_let_go(running: Running) -> None:
    running.order(LookAt((1.2, 0.6, 0.3), "a show", stay=True))
    assert running.go(3.0)[-1].led
    running.order(LookAt(None, "another"))
    assert running.go(0.1)[-1].led == ""


# Floods


def test_orders_that_wait_are_bounded_and_a_stop_goes_before_them(running: Running) -> None:
    robot = running.made.robot
    with pytest.raises(ValueError, match="too many requests"):
        for _ in range(1000):
            robot.command(Ask("lids", "awake"))
    stop = robot.command(Stop("a hand"))
    tick = running.go(0.006)[0]
    assert tick.commands[0] == Stop("a hand") and len(tick.commands) <= 9
    assert stop.wait(0.0) is not None and tick.stopped
    for _ in range(1000):
        robot.command(Stop("again"))
    assert len(robot._commands) <= 128

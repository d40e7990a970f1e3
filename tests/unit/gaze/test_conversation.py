"""Conversation: the state that a voice agent reports, its end, and what the gaze makes of it."""

from math import inf

import msgspec
import pytest

import gazerig
from gazerig.gaze.attention.conversation import NOD
from gazerig.robot.dashboard.door.client_socket import ClientSocket, Visitor, Wishes
from gazerig.robot.loop.client_control import Conversation
from gazerig.robot.loop.head_state import HeadState, head_state
from gazerig.robot.model.commands import LookAt, Renew, Talk
from gazerig.robot.model.reply import CommandReply

pytestmark = pytest.mark.usefixtures("ideal_servos")


def test_states_follow_each_other_and_are_in_tick_and_state(running):
    def talk(state, partner=None, **more):
        return running.do(Talk(state, partner, who="a", stay=True, **more))[1][-1].conversation

    person = talk("listening", 1)
    assert (person.number, person.state, person.partner, person.who) == (1, "listening", 1, "a")
    assert talk("thinking").partner == 1
    spoken = talk("speaking", seconds=2.0)
    assert spoken.ends_s == spoken.since_s + 2.0 and spoken.confidence > 0.8
    running.go(1.0)
    changed = talk("speaking", text="x" * 30)  # the plan is corrected, the state continues
    assert (changed.number, changed.since_s) == (spoken.number, spoken.since_s)
    assert changed.ends_s == pytest.approx(running.ticks[-1].t_s + 2.0, abs=0.01)
    assert changed.confidence < 0.5
    assert talk("speaking", text=" ").ends_s is None
    timed = talk("speaking", seconds=3.0)
    state = head_state(running.ticks[-1])
    assert state.conversation == timed
    assert msgspec.json.decode(msgspec.json.encode(state), type=HeadState) == state
    assert talk("interrupt").state == "interrupted"
    assert talk("idle").state == "idle"


@pytest.mark.parametrize(
    ("given", "lasts_s", "reason"),
    [
        (Talk("speaking", seconds=9.0, who="a"), 1.0, "not renewed"),  # the program has died
        (Talk("listening", who="a"), 1.0, "not renewed"),
        (Talk("speaking", seconds=2.0, stay=True), 62.0, "no report for 60 s"),
        (Talk("thinking", stay=True), 60.0, "no report for 60 s"),
        (Talk("listening", stay=True), inf, ""),
    ],
)
def test_a_state_ends_without_its_program(given, lasts_s, reason):
    conversation = Conversation()
    conversation.report(given, 5.0)
    assert conversation.expiry_reason(5.0 + min(lasts_s, 3600.0) - 0.03) == ""
    assert reason in conversation.expiry_reason(5.0 + min(lasts_s, 3600.0) + 0.03)


def test_an_end_is_told_once_and_the_gaze_goes_on(running):
    running.do(Talk("speaking", seconds=9.0, who="a"))
    ticks = running.go(1.5)
    assert ticks[-1].conversation.end_reason == "not renewed"
    assert sum(text.startswith("conversation: ") for one in ticks for text in one.events) == 1
    assert ticks[-1].target.kind in ("face", "away")


def test_one_heartbeat_renews_gaze_and_conversation_of_one_client(running):
    running.do(LookAt((1.0, 0.0, 0.3), who="a"))
    running.do(Talk("listening", who="a"))
    for _ in range(4):
        running.go(0.5)
        assert not running.do(Renew(who="a"))[0].refused
        assert running.do(Renew(who="b"))[0].refused
    assert running.ticks[-1].controlled_by and running.ticks[-1].conversation.state == "listening"
    running.do(LookAt(None, who="a"))
    assert not running.do(Renew(who="a"))[0].refused  # it still has the conversation


def test_the_newer_of_two_agents_has_the_conversation(running):
    running.do(Talk("speaking", seconds=5.0, who="a"))
    ticks = running.do(Talk("listening", who="b"))[1]
    assert [text for one in ticks for text in one.events] == ["conversation: b takes over from a"]
    assert running.do(Renew(who="a"))[0].refused == "the head is no longer controlled by a"
    running.go(0.9)
    running.do(Renew(who="b"))
    assert running.go(0.5)[-1].conversation.who == "b"


# Gaze


def wait_for(running, kind, within_s):
    """Return the time until the target is of a kind, inf if it is not in time."""
    start_s = running.ticks[-1].t_s
    for tick in running.go(within_s):
        if tick.target.kind == kind:
            return tick.t_s - start_s
    return inf


def test_a_turn_is_thought_spoken_and_interrupted_with_the_gaze(running):
    running.do(Talk("listening", stay=True), 2.0)
    running.do(Talk("thinking", stay=True))
    assert wait_for(running, "away", 0.3) < 0.05
    running.do(Talk("speaking", seconds=5.0, stay=True), 0.5)
    assert running.ticks[-1].target.kind == "away"  # the look of thinking continues
    late = [tick for tick in running.go(6.0) if tick.t_s > running.ticks[-1].t_s - 2.0]
    assert {tick.target.kind for tick in late} == {"face"}  # the end, and the time after it
    running.do(Talk("thinking", stay=True), 0.5)
    assert running.ticks[-1].target.kind == "away"
    running.do(Talk("interrupt", stay=True))
    assert wait_for(running, "face", 0.3) < 0.02


def test_a_listener_nods_on_the_robot():
    with gazerig.open("desk", fast=True, scene="face-to-face") as head:
        head.listening()
        assert head.run_until(lambda state: any(one.name == NOD for one in state.tracks), 40.0)


def test_a_websocket_renews_what_its_program_controls():
    program = ClientSocket(Wishes(), Visitor("", "here"), "")
    started = CommandReply(control_number=1)
    look = {"do": "look_at", "p_world_m": [1.0, 0.0, 0.0], "who": "a"}
    for message, reply, held in (
        ({"do": "talk", "state": "listening", "who": "a"}, CommandReply(), {"talk"}),
        (look, started, {"talk", "gaze"}),
        ({**look, "p_world_m": None}, CommandReply(), {"talk"}),
        ({"do": "play", "track": "nod", "who": "a"}, CommandReply(), {"talk"}),
        ({"do": "talk", "state": "speaking", "stay": True, "who": "a"}, CommandReply(), set()),
        ({"do": "talk", "state": "thinking", "who": "b"}, CommandReply(), {"talk"}),
        ({"do": "talk", "state": "idle", "who": "b"}, CommandReply(), set()),
        (look, started, {"gaze"}),
        ({**look, "pointer": True}, started, set()),  # in control only while it moves
    ):
        program.hold(message, reply)
        assert program.held == held and program.who == message["who"]

"""The simulated voice agent of a scene, and the conversation that the page plays."""

from dataclasses import replace
from pathlib import Path

import pytest
from shown_page import SNAPSHOT

import gazerig
from gazerig.config.faults import ConfigError
from gazerig.config.load import shipped_path
from gazerig.robot.app.mock_agent import AGENT
from gazerig.robot.app.scene_files import load_scene
from gazerig.robot.dashboard.panels.controls import TalkPanel, talk_text
from gazerig.robot.dashboard.panels.event_timeline import Timeline
from gazerig.robot.dashboard.requests.page_requests import PageRequestHandler
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.conversation import ConversationState

pytestmark = pytest.mark.usefixtures("ideal_servos")


class Asked:
    """What the page asks of the rig."""

    def __init__(self) -> None:
        self.asked: list[tuple[object, str]] = []

    def ask(self, what: object, who: str) -> None:
        self.asked.append((what, who))


def turns(head: gazerig.SimulatedHead, seconds: float) -> list[tuple[float, str]]:
    """Return times and names of the states that begin within a time."""
    found: list[tuple[float, str]] = []
    for _ in range(round(seconds / 0.1)):
        head.step(0.1)
        state = head.state.conversation
        if not found or found[-1][1] != state.state:
            found.append((round(head.state.t_s, 1), state.state))
    return found


@pytest.mark.parametrize("scene", ["interview", "table"])
def test_an_agent_reports_the_turns_of_its_script(scene: str) -> None:
    acts = load_scene(scene).agent
    with gazerig.open("desk", fast=True, bus="ideal", scene=scene, say=lambda line: None) as head:
        found = turns(head, 60.0 + acts[0].at_s + 1.5)
    names = {"interrupt": "interrupted"}
    expected = [(act.at_s, names.get(act.state, act.state)) for act in acts]
    assert found[0][1] == "idle"
    begun = found[1 : len(expected) + 1]
    assert [state for _, state in begun] == [state for _, state in expected]
    late = [at_s - due_s for (at_s, _), (due_s, _) in zip(begun, expected, strict=True)]
    assert max(late) - min(late) <= 0.21  # the scene begins a moment after the head
    assert found[-1][1] == expected[0][1]  # the next round


def test_the_partner_of_a_table_is_the_one_who_is_named() -> None:
    with gazerig.open("desk", fast=True, bus="ideal", scene="table", say=lambda line: None) as head:
        partners = []
        for at_s in (8.0, 36.5):
            head.step(at_s - head.state.t_s)
            state = head.state
            assert state.conversation.who == AGENT
            partner = next(p for p in state.people if p.id == state.conversation.partner)
            partners.append(partner.position_m[1] > 0.0)
    assert partners == [True, False]  # the left one, then the right one


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("  - {at_s: 99.0, state: idle}", "within the round"),
        ("  - {at_s: 1.0, state: idle}", "order of time"),
        ("  - {at_s: 57.0, state: idle, person: nobody}", "no person of the script"),
        ("  - {at_s: 57.0, state: dancing}", "listening"),
        ("  - {at_s: 57.0, state: speaking, seconds: -1}", "seconds"),
    ],
)
def test_a_faulty_script_is_refused_with_its_line(tmp_path: Path, line: str, fault: str) -> None:
    text = shipped_path("scenes", "interview").read_text(encoding="utf-8")
    (path := tmp_path / "mine.yaml").write_text(text + line + "\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=fault) as refused:
        load_scene(str(path))
    assert f"mine.yaml:{len(text.splitlines()) + 1}" in str(refused.value)


def test_the_page_plays_a_minute_of_conversation_on_request() -> None:
    outbox = Asked()
    panel = TalkPanel(Widgets().panel("steer"), outbox)  # type: ignore[arg-type]
    panel.demo.receive_input("play a minute of conversation", "5")
    assert outbox.asked == [({"play_talk": True}, "5")]
    played: list[bool] = []

    def play() -> str:
        played.append(True)
        return "the head talks"

    handler = PageRequestHandler(lambda command: None, talk=play)
    assert handler({"play_talk": True, "who": "a browser"}) == "the head talks" and played
    assert "not available" in str(PageRequestHandler(lambda command: None)({"play_talk": True}))


def test_the_page_shows_the_turns() -> None:
    talk = ConversationState(3, "speaking", 1, 10.0, 16.0, 0.9, "Hello", "agent")
    assert talk_text(talk, 12.0) == (
        "agent: speaking, with person 1, for 2 s, 4 s to its planned end"
    )
    assert talk_text(ConversationState(end_reason="not renewed"), 1.0).endswith("not renewed")
    strip = Timeline()
    for t_s, state in ((10.0, talk), (12.0, talk._replace(state="interrupted")), (13.0, talk)):
        strip.update(replace(SNAPSHOT, t_s=t_s, talk=state))
    assert [what for _, _, what in strip.intervals("head")] == [
        "speaking", "interrupted", "speaking",
    ]  # fmt: skip
    assert "turns speaking, interrupted" in strip.drawing()

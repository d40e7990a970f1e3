"""The simulated voice agent of a scene, and the conversation that the page plays."""

import pytest
from slow_rigs import at_rate

import gazerig
from gazerig.config.faults import ConfigError
from gazerig.config.load import shipped_path
from gazerig.robot.run.surroundings import load_scene

pytestmark = pytest.mark.usefixtures("ideal_servos")


def turns(head: gazerig.SimulatedHead, seconds: float) -> list[tuple[float, str]]:
    """Return times and names of the states that begin within a time."""
    found: list[tuple[float, str]] = []
    for _ in range(round(seconds / 0.1)):
        head.step(0.1)
        state = head.state.conversation
        if not found or found[-1][1] != state.state:
            found.append((round(head.state.t_s, 1), state.state))
    return found


SCENE = """\
description: two people and a voice agent
room: none
round_s: 4.0
places: {chair: {x_m: 1.05, y_m: 0.05, height_m: 1.21}, sofa: {x_m: 1.3, y_m: 0.4, height_m: 1.2}}
people: {visitor: {start: chair}, other: {start: sofa}}
agent:
  - {at_s: 0.5, state: listening, person: visitor}
  - {at_s: 1.0, state: thinking}
  - {at_s: 1.4, state: speaking, text: "That is a good question."}
  - {at_s: 2.0, state: interrupt}
  - {at_s: 2.4, state: listening, person: other}
  - {at_s: 2.9, state: speaking, seconds: 8.0}
  - {at_s: 3.5, state: idle}
"""


def test_an_agent_reports_the_turns_of_its_script_round_after_round(tmp_path):
    (path := tmp_path / "quick.yaml").write_text(SCENE)
    acts = load_scene(str(path)).agent
    with gazerig.open(
        at_rate(tmp_path, "desk", 50.0), fast=True, bus="ideal", scene=str(path)
    ) as head:
        found = turns(head, 4.0 + acts[0].at_s + 1.5)
    names = {"interrupt": "interrupted"}
    expected = [(act.at_s, names.get(act.state, act.state)) for act in acts]
    assert found[0][1] == "idle"
    begun = found[1 : len(expected) + 1]
    assert [state for _, state in begun] == [state for _, state in expected]
    late = [at_s - due_s for (at_s, _), (due_s, _) in zip(begun, expected, strict=True)]
    assert max(late) - min(late) <= 0.21  # the scene begins a moment after the head
    again_s, again = found[len(expected) + 1]
    assert again == "listening" and again_s - begun[0][0] == pytest.approx(4.0, abs=0.11)


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("  - {at_s: 99.0, state: idle}", "within the round"),
        ("  - {at_s: 1.0, state: idle}", "order of time"),
        ("  - {at_s: 57.0, state: idle, person: nobody}", "no 'nobody' here"),
        ("  - {at_s: 57.0, state: dancing}", "listening"),
        ("  - {at_s: 57.0, state: speaking, seconds: -1}", "seconds"),
    ],
)
def test_a_faulty_script_is_refused_with_its_line(tmp_path, line, fault):
    text = shipped_path("scenes", "interview").read_text()
    (path := tmp_path / "mine.yaml").write_text(text + line + "\n")
    with pytest.raises(ConfigError, match=fault) as refused:
        load_scene(str(path))
    assert f"mine.yaml:{len(text.splitlines()) + 1}" in str(refused.value)

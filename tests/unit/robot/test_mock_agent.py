"""The simulated voice agent of a scene, and the conversation that the page plays."""

from pathlib import Path

import pytest

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


@pytest.mark.parametrize("scene", ["interview", "table"])
def test_an_agent_reports_the_turns_of_its_script(scene: str):
    acts = load_scene(scene).agent
    with gazerig.open("desk", fast=True, bus="ideal", scene=scene) as head:
        found = turns(head, 60.0 + acts[0].at_s + 1.5)
    names = {"interrupt": "interrupted"}
    expected = [(act.at_s, names.get(act.state, act.state)) for act in acts]
    assert found[0][1] == "idle"
    begun = found[1 : len(expected) + 1]
    assert [state for _, state in begun] == [state for _, state in expected]
    late = [at_s - due_s for (at_s, _), (due_s, _) in zip(begun, expected, strict=True)]
    assert max(late) - min(late) <= 0.21  # the scene begins a moment after the head
    assert found[-1][1] == expected[0][1]  # the next round


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
def test_a_faulty_script_is_refused_with_its_line(tmp_path: Path, line: str, fault: str):
    text = shipped_path("scenes", "interview").read_text()
    (path := tmp_path / "mine.yaml").write_text(text + line + "\n")
    with pytest.raises(ConfigError, match=fault) as refused:
        load_scene(str(path))
    assert f"mine.yaml:{len(text.splitlines()) + 1}" in str(refused.value)

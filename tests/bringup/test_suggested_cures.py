"""Every cure that the doctor suggests can be typed and reaches the same rig and port."""

import re
import shlex
from pathlib import Path

import pytest
import typer
from test_cli_bringup import SMALL
from typer.testing import CliRunner

from gazerig.robot.cli.main import app
from gazerig.sim_mock.pty.client import PtyBus

pytestmark = pytest.mark.usefixtures("simulated_wires")

DESK = Path(__file__).parents[2] / "config/rigs/desk.yaml"


def commands_in(text: str) -> list[list[str]]:
    """Return every command of the family that reaches servos, as it would be typed."""
    token = r"(?: (?:--[a-z]+|'[^']+'|/\S*[\w]|\w+\.yaml|\d+\b|(?<=--joint )\w+|desk\b))*"
    found = re.findall(rf"gazerig (?:doctor|setup|reboot|calibrate|scan|home)\b{token}", text)
    return [shlex.split(one)[1:] for one in found if one != "gazerig reboot"]


def parsed(words: list[str]) -> dict[str, object]:
    """Parse a command as the command line does, without running it."""
    group = typer.main.get_command(app)
    context = group.make_context("gazerig", list(words), resilient_parsing=False)
    name, command, rest = group.resolve_command(context, list(words))  # type: ignore[attr-defined]
    with command.make_context(name, rest, parent=context) as made:
        return dict(made.params)


@pytest.mark.parametrize("fault", ["overload 7", "stick 7"])
@pytest.mark.parametrize("asked", [["doctor"], ["doctor", "--fix"], ["doctor", "--json"]])
def test_every_cure_of_the_doctor_can_be_typed(
    fault: str, asked: list[str], tmp_path, capfd
) -> None:
    rig = tmp_path / "mine.yaml"
    rig.write_text(DESK.read_text())
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=1_000_000)
        bus.command(fault)
        made = CliRunner().invoke(app, [*asked, str(rig), "--port", path])
    said = made.output
    found = commands_in(said)
    assert found
    for words in found:
        values = parsed(words)
        assert values["port"] == path, words
        if "rig" in values and words[0] != "scan":
            assert values["rig"] == str(rig), words

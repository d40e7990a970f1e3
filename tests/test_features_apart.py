"""Each feature can be removed: the rest runs as before, and its command names what is missing."""

from pathlib import Path

import pytest
from features_apart import FEATURES, bus_digest, gazerig, lay_out, removed_with
from outside_package import install

COMMANDS = {
    "study": ("study",),
    "lab": ("report", "compare", "sweep", "fit-scanpath", "study"),
    "bringup": (
        *("scan", "setup", "doctor", "calibrate", "jog", "home", "look-at", "monitor", "reboot"),
        "record-gesture",
    ),
}
SECONDS = 0.5


@pytest.fixture(scope="module")
def with_all(tmp_path_factory: pytest.TempPathFactory) -> str:
    return bus_digest(lay_out(tmp_path_factory.mktemp("whole")), SECONDS)


@pytest.mark.parametrize("feature", FEATURES)
def test_without_a_feature_the_rest_runs(feature: str, with_all: str, tmp_path: Path) -> None:
    package = lay_out(tmp_path, removed_with(feature))
    assert bus_digest(package, SECONDS) == with_all
    done = gazerig(package, COMMANDS[feature][0], "--help")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and line.endswith(f"No module named 'gazerig.features.{feature}'")


@pytest.mark.parametrize("feature", FEATURES)
def test_help_lists_only_the_commands_that_are_there(feature: str, tmp_path: Path) -> None:
    shown = gazerig(lay_out(tmp_path, removed_with(feature)), "--help").stdout
    listed = {line.split()[1] for line in shown.splitlines() if line.startswith("│ ")}
    assert {"run", "replay", "export", "check"} <= listed
    assert not listed & set(COMMANDS[feature])


WAVER = """
from dataclasses import dataclass
import typer
from gazerig.robot.cli.command_list import CommandEntry
WAVE = CommandEntry("waver", "Wave a hand.")
app = typer.Typer()
@dataclass(frozen=True)
class Wave:
    times: int = 3
@app.command()
def wave():
    print("waved")
"""


def test_another_package_brings_a_command_and_a_schema(tmp_path: Path) -> None:
    package = lay_out(tmp_path)
    parts = {"gazerig.command": {"wave": "waver:WAVE"}, "gazerig.schema": {"wave": "waver:Wave"}}
    install(package, "waver", parts, {"waver": WAVER})
    assert gazerig(package, "wave").stdout == "waved\n"
    assert "Wave a hand." in gazerig(package, "--help").stdout
    assert '"times"' in gazerig(package, "schema", "--of", "wave").stdout


def test_every_feature_has_tests() -> None:
    for feature in FEATURES:
        assert list(Path(__file__).parent.glob(f"{feature}/test_*.py"))

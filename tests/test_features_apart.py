"""Each feature can be removed: the rest runs as before, and its command names what is missing."""

import os
import subprocess
from pathlib import Path

import pytest
from features_apart import FEATURES, ROOT, bus_digest, gazerig, lay_out, removed_with
from outside_package import install

from gazerig.robot.recording.read import RunRecording

COMMANDS = {
    "animation": ("import", "export-track"),
    "study": ("study",),
    "lab": ("report", "compare", "sweep", "fit-scanpath"),
    "world": (),
    "bringup": (
        *("scan", "setup", "doctor", "calibrate", "jog", "home", "look-at", "monitor", "reboot"),
        "record-track",
    ),
}
IN_WORLD = ("run", "desk", "--mock", "--fast", "--no-page", "--world", "living-room")
"""An option that is the world's; a feature with commands names what is missing by the first."""
SECONDS = 0.5


@pytest.fixture(scope="module")
def with_all(tmp_path_factory: pytest.TempPathFactory) -> str:
    return bus_digest(lay_out(tmp_path_factory.mktemp("whole")), SECONDS)


@pytest.mark.parametrize("feature", FEATURES)
def test_without_a_feature_the_rest_runs(feature: str, with_all: str, tmp_path: Path) -> None:
    package = lay_out(tmp_path, removed_with(feature))
    assert bus_digest(package, SECONDS) == with_all
    asked = IN_WORLD if feature == "world" else (COMMANDS[feature][0], "--help")
    done = gazerig(package, *asked)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and line.endswith(f"No module named 'gazerig.features.{feature}'")


@pytest.mark.parametrize("feature", FEATURES)
def test_help_lists_only_the_commands_that_are_there(feature: str, tmp_path: Path) -> None:
    shown = gazerig(lay_out(tmp_path, removed_with(feature)), "--help").stdout
    listed = {line.split()[1] for line in shown.splitlines() if line.startswith("│ ")}
    gone = removed_with(feature)
    others = {one for name in FEATURES if name not in gone for one in COMMANDS[name]}
    assert {"run", "rerun", "export", "check", *others} <= listed
    assert not listed & {one for name in gone for one in COMMANDS[name]}


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


HALL = """
from gazerig.robot.app.camera_factory import frame_locator, scene_camera, true_head_pose
from gazerig.robot.app.run_bus import run_bus
from gazerig.robot.app.surroundings import Surroundings
from gazerig.robot.app.scene_files import load_scene
class Room:
    def __init__(self, rig, options, clock):
        self.scene, self.clock = load_scene("visitor"), clock
        self.run_bus = run_bus(rig, options, clock)
    def camera(self, rig, options, sight, placed, rng, own, say):
        where = true_head_pose(self.run_bus.true_steps, rig, sight.poses)
        look = frame_locator(placed)
        return scene_camera(rig, options, self.scene, sight.mount, where, rng, look, own)
    def start_s(self):
        return 0.0
    def shapes(self):
        return None
class Hall(Surroundings):
    def scene(self, options):
        return load_scene("visitor")
    def open(self, rig, options, clock):
        return Room(rig, options, clock)
"""


def test_another_package_brings_surroundings(with_all: str, tmp_path: Path) -> None:
    """The visitor of a scene, seen by a camera of theirs: the head does just what it does there."""
    package, file = lay_out(tmp_path), tmp_path / "run.mcap"
    parts = {"gazerig.surroundings": {"hall": "hall:Hall", "yard": "hall:Room"}}
    install(package, "hall", parts, {"hall": HALL})
    place = ("--world", "hall", "--record", str(file))
    assert bus_digest(package, SECONDS, place) == with_all
    assert RunRecording(file).info.scene == "hall"
    done = gazerig(package, *IN_WORLD[:-1], "yard")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and "surroundings 'yard' of hall" in line


def test_every_feature_has_tests() -> None:
    for feature in FEATURES:
        assert list(Path(__file__).parent.glob(f"{feature}/test_*.py"))


def test_make_run_has_a_scene_where_there_is_no_world(tmp_path: Path) -> None:
    """In a folder without features, with a program that prints its arguments."""
    (tmp_path / "pyproject.toml").touch()
    program = tmp_path / ".venv" / "bin" / "gazerig"
    program.parent.mkdir(parents=True)
    program.write_text('#!/bin/sh\necho "$@"\n')
    program.chmod(0o755)
    (program.parent / "python").write_text(
        '#!/bin/sh\ncase $2 in *.own_session) shift 2; exec "$@" ;; esac\necho --computer small\n'
    )
    (program.parent / "python").chmod(0o755)
    (tmp_path / ".venv" / ".installed").touch()
    done = subprocess.run(
        ["make", "--silent", "-C", str(tmp_path), "-f", str(ROOT / "Makefile"), "run"],
        capture_output=True, text=True, check=True,
        env={key: value for key, value in os.environ.items() if not key.startswith("MAKE")},
    )  # fmt: skip
    assert done.stdout == "run --mock --computer small\n"
    assert done.stderr == "a visitor without a room: features/world is not there\n"

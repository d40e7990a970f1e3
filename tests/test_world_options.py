"""What can be asked of a world on the command line, and what is refused in one line."""

import importlib.util
from dataclasses import fields, replace
from pathlib import Path

import pytest

from gazerig.config.faults import ConfigError
from gazerig.config.schema import load_rig
from gazerig.config.shipped import shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_world import world_of
from gazerig.robot.cli.run import what_runs
from gazerig.sim_mock.world.camera_params import WorldCameraParams

ASKED = RunOptions(mock=True, world="living-room")


def test_a_world_is_what_is_looked_at() -> None:
    found = ASKED.checked()
    assert (found.world, found.scene, found.looks_through) == ("living-room", None, None)
    assert "a world, living-room" in what_runs(found)
    assert replace(ASKED, fast=True).checked().seconds is None  # a whole round, as of a scene


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"mock": False}, "--world needs --mock"),
        ({"scene": "visitor"}, "--scene and --world exclude each other"),
        ({"camera": 0}, "--camera and --world exclude each other"),
        ({"oak": True}, "--oak and --world exclude each other"),
        ({"pixels": True}, "rendered in any case"),
        ({"bus": "ideal", "fast": False}, "needs --fast: in real time"),
        ({"world": None, "no_pictures": True}, "--no-pictures needs --world"),
    ],
)
def test_what_does_not_fit_is_refused(changes: dict[str, object], why: str) -> None:
    with pytest.raises(SetupError, match=why):
        replace(ASKED, **changes).checked()  # type: ignore[arg-type]


def test_a_missing_package_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr("gazerig.robot.app.run_world.find_spec", lambda name: None)
    with pytest.raises(
        SetupError, match=r"mujoco is not installed: pip install 'gazerig\[world\]'"
    ):
        world_of(load_rig("desk"), ASKED)


def test_a_world_that_is_not_there_is_said_with_those_that_are(tmp_path: Path) -> None:
    rig = load_rig("desk")
    with pytest.raises(ConfigError, match="living-room"):
        world_of(rig, replace(ASKED, world="living-rom"))
    with pytest.raises(SetupError, match="there is no such file"):
        world_of(rig, replace(ASKED, world=str(tmp_path / "mine.xml")))


def test_a_script_at_fault_is_said_with_file_line_and_key(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("room: living-room\npeople:\n  anna:\n    start: dor\n")
    with pytest.raises(ConfigError) as found:
        world_of(load_rig("desk"), replace(ASKED, world=str(file)))
    assert "mine.yaml:4" in str(found.value) and "people.anna.start" in str(found.value)


def test_every_shipped_world_can_be_read() -> None:
    rig = load_rig("desk")
    for name in shipped_names("worlds"):
        world = world_of(rig, replace(ASKED, world=name, no_pictures=True))
        assert world is not None and world.scene.name == name
        assert world.scene.people(0.0) or len(world.spec.rigs) > 1


def test_the_paper_has_every_parameter_of_the_camera() -> None:
    paper = (Path(__file__).parents[1] / "docs/worlds.md").read_text(encoding="utf-8")
    for field in fields(WorldCameraParams):
        assert f"| `{field.name}` |" in paper

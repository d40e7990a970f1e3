"""RIG is a word of every command, the first one; options of earlier versions still work."""

from typing import Any

import pytest
import typer
from features_there import skip_without
from typer.core import TyperGroup

from gazerig.robot.cli.command_list import PANELS
from gazerig.robot.cli.main import app


def group_of_all() -> TyperGroup:
    group = typer.main.get_command(app)
    assert isinstance(group, TyperGroup)
    return group


def values(*words: str) -> dict[str, Any]:
    """Parse a command as the command line does, without running it."""
    skip_without(words[0])
    command = group_of_all().commands[words[0]]
    return dict(command.make_context(words[0], list(words[1:])).params)


@pytest.mark.parametrize(
    ("words", "rig"),
    [
        (("jog", "neck_yaw", "-10"), "desk"),
        (("jog", "--speed", "5", "my.yaml", "neck_yaw", "-10", "--mock"), "my.yaml"),
        (("look-at", "1", "-0.2", "0.3"), "desk"),
        (("look-at", "maker", "1", "-0.2", "0.3"), "maker"),
        (("reboot", "7", "neck_yaw"), "desk"),
        (("reboot", "feetech", "7", "neck_yaw"), "feetech"),
        (("reboot", "./feetech", "7", "neck_yaw"), "./feetech"),
        (("reboot", "7", "neck_yaw", "--port", "/dev/ttyACM0"), "desk"),
        (("scan",), None),
        (("scan", "my.yaml"), "my.yaml"),
        (("emulate", "maker"), "maker"),
        (("replay", "a.mcap", "my.yaml", "--rerun"), "my.yaml"),
        (("home", "my.yaml"), "my.yaml"),
    ],
)
def test_the_rig_is_found_among_the_words(words: tuple[str, ...], rig: str | None) -> None:
    read = values(*words)
    assert read["rig"] == rig
    if words[0] == "jog":
        assert (read["joint"], read["deg"]) == ("neck_yaw", -10.0)
    elif words[0] == "look-at":
        assert (read["x"], read["y"], read["z"]) == (1.0, -0.2, 0.3)
    elif words[0] == "reboot":
        assert list(read["servos"]) == ["7", "neck_yaw"]


def test_no_command_has_a_rig_option() -> None:
    waiting: list[Any] = list(group_of_all().commands.values())
    for command in waiting:
        waiting.extend(getattr(command, "commands", {}).values())
        assert not any("--rig" in param.opts for param in command.params), command.name


def test_every_command_stands_in_a_panel_of_help_and_in_its_order() -> None:
    group = group_of_all()
    context = typer.Context(group)
    shown = group.list_commands(context)
    panels = [str(group.commands[name].rich_help_panel) for name in shown]  # type: ignore[attr-defined]
    assert panels == sorted(panels, key=list(PANELS).index)
    assert set(shown) == set(group.commands)

"""The commands of ``gazerig``: their modules, and their lines in the list of commands.

The list is static, because a short command must not import the modules of all others;
tests/test_cli_start.py compares it with them. Commands of features and packages come from entry
points.
"""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import NamedTuple

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import COMMAND, SHIPPED, Registration, find, registrations

Examples = tuple[tuple[str, str], ...]
"""Arguments of ``gazerig``, and their purpose."""


class CommandEntry(NamedTuple):
    """One command in the list; the object of an entry point of the group ``gazerig.command``.

    Attributes:
        module: Module whose ``app``, a ``typer.Typer``, contains the command.
        summary: First paragraph of its help.
        panel: Panel of the help that lists it.
        examples: Examples for its help by its name; for commands of a group by both names.
    """

    module: str
    summary: str
    panel: str = "Tools"
    examples: Mapping[str, Examples] = MappingProxyType({})


SPECIALIST = "For specialists"
"""Panel of commands that are not needed for a first head."""

PANELS: dict[str, dict[str, CommandEntry]] = {
    "Run": {
        "run": CommandEntry(
            "run", "Run the head: gazerig run --mock, then open the page at the printed address."
        ),
        "ctl": CommandEntry(
            "tune",
            "Control a rig that runs in another terminal: parameters, gaze target, behaviour.",
        ),
        "stop": CommandEntry(
            "tune",
            "Switch the torque of every running rig off at once; nothing parks, the programs continue.",
        ),
    },
    "Look back": {
        "rerun": CommandEntry(
            "recordings",
            "Run a recording's input through the present models: same input, same bytes.",
        ),
        "export": CommandEntry(
            "recordings",
            "Export a run as CSV for eye-tracking tools: samples and events, degrees, + left and + "
            "up.",
        ),
    },
    "Study": {},
    "Bring-up": {},
    "Tools": {
        "new": CommandEntry(
            "new",
            "Write a new rig's YAML from a few answers, check it, and print the next command.",
        ),
        "check": CommandEntry(
            "rig_check",
            "Check a rig's YAML and list all faults at once; no servo is contacted.",
        ),
        "door": CommandEntry(
            "door",
            "Let a voice assistant or agent take part with the running head; without a name, list "
            "all.",
        ),
        "models": CommandEntry(
            "models",
            "List and download model files that detect faces, people, hands and eyes.",
        ),
    },
    SPECIALIST: {
        "describe": CommandEntry(
            "describe",
            "Write a rig as a robot description: MJCF, URDF and glTF with meshes, or one of them.",
        ),
        "emulate": CommandEntry(
            "emulate",
            "Emulate servos on a pseudo-terminal; print its path as JSON and accept fault commands.",
        ),
    },
}
"""Panel of the help -> the core's commands in it, by the name of their module in this folder."""


@cache
def shipped_commands() -> Mapping[str, CommandEntry]:
    """Return the commands of the core and of the installed features, by name."""
    found = {
        name: CommandEntry(f"gazerig.robot.cli.{entry.module}", entry.summary, panel)
        for panel, entries in PANELS.items()
        for name, entry in entries.items()
    }
    return found | _load_entries([find(COMMAND, name) for name in SHIPPED[COMMAND]])


def package_commands() -> Mapping[str, CommandEntry]:
    """Return the commands of installed packages, by name."""
    return _load_entries([one for one in registrations(COMMAND) if not one.is_ours])


def sort_by_panel(commands: Mapping[str, CommandEntry]) -> list[str]:
    """Return names of commands by panel, in the order of the help."""
    panels = [*PANELS, *(entry.panel for entry in commands.values())]
    return sorted(commands, key=lambda name: panels.index(commands[name].panel))


def _load_entries(parts: list[Registration]) -> dict[str, CommandEntry]:
    """Return the commands whose parts can be loaded."""
    found = {}
    for one in parts:
        try:
            entry = one.load()
        except PluginError:
            continue  # reported when the command is used
        if isinstance(entry, CommandEntry):
            found[one.name] = entry
    return found

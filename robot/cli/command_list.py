"""The commands of ``gazerig``: their modules, lines in the list of commands, and examples.

The list is static, because a short command must not import the modules of all others;
tests/unit/robot/test_console.py compares it with them. Commands of features and packages come from
entry points, those of the core are in commands.json.
"""

from collections import UserDict
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec
import typer

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import COMMAND, SHIPPED, Registration, find, registrations


class CommandEntry(msgspec.Struct, frozen=True):
    """One command in the list; the object of an entry point of the group ``gazerig.command``.

    Attributes:
        module: Module whose ``app``, a ``typer.Typer``, contains the command.
        summary: First paragraph of its help.
        panel: Panel of the help that lists it.
        examples: Examples for its help: arguments of ``gazerig``, and their purpose.
    """

    module: str
    summary: str
    panel: str = "Tools"
    examples: tuple[tuple[str, str], ...] = ()


PANELS = ("Run", "Look back", "Study", "Bring-up", "Tools", "For specialists")
"""Panels of the help in their order."""
SPECIALIST = PANELS[-1]
"""Panel of commands that are not needed for a first head."""


def shipped_commands() -> dict[str, CommandEntry]:
    """Return the commands of the core and of the installed features, by name."""
    text = Path(__file__).with_name("commands.json").read_bytes()
    core = msgspec.json.decode(text, type=dict[str, CommandEntry])
    return core | _load_entries(find(COMMAND, name) for name in SHIPPED[COMMAND])


def _load_entries(parts: Iterable[Registration]) -> dict[str, CommandEntry]:
    """Return the commands whose parts can be loaded."""
    found = {}
    for part in parts:
        try:
            entry = part.load()
        except PluginError:
            continue  # reported when the command is used
        if isinstance(entry, CommandEntry):
            found[part.name] = entry
    return found


class Commands(UserDict[str, Any]):
    """Commands by name, each imported on access.

    entries: their entries in the list
    """

    def __init__(self) -> None:
        self.entries = shipped_commands()
        super().__init__(self.entries)

    def add_packages(self) -> None:
        """Add the commands of installed packages; existing names are not replaced."""
        packages = _load_entries(one for one in registrations(COMMAND) if not one.is_ours)
        self.entries = packages | self.entries
        self.data = packages | self.data

    def names(self) -> list[str]:
        """Return the names by panel, in the order of the help."""
        panels = [*PANELS, *(entry.panel for entry in self.entries.values())]
        return sorted(self.entries, key=lambda name: panels.index(self.entries[name].panel))

    def __getitem__(self, name: str) -> Any:
        """Return a complete command; raise KeyError if the name is unknown."""
        if isinstance(entry := self.data[name], CommandEntry):
            app = typer.Typer()
            app.add_typer(import_module(entry.module).app)
            command: Any = typer.main.get_group(app).commands[name]
            command.rich_help_panel = entry.panel
            examples = (f"gazerig {text}   ({what})" for text, what in entry.examples)
            command.epilog = "\n\n".join(examples)
            self.data[name] = command
        return self.data[name]

"""The commands of ``gazerig``: their modules, lines in the list of commands, and examples.

The list is static, because a short command must not import the modules of all others;
tests/test_cli_start.py compares it with them. Commands of features and packages come from entry
points, those of the core are in commands.json.
"""

from collections import UserDict
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec
import typer

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import COMMAND, SHIPPED, Registration, find, registrations

Examples = tuple[tuple[str, str], ...]
"""Arguments of ``gazerig``, and their purpose."""


class CommandEntry(msgspec.Struct, frozen=True):
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
    examples: Mapping[str, Examples] = {}


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
            _add_examples(app, entry.examples)
            self.data[name] = typer.main.get_group(app).commands[name]
            self.data[name].rich_help_panel = entry.panel
        return self.data[name]


def _add_examples(app: typer.Typer, given: Mapping[str, Examples], within: str = "") -> None:
    """Add examples to the help of every command of an app.

    Args:
        app: The app.
        given: Examples by command; for a feature's group of commands with the group's name.
        within: Group that contains the app, "" for none.
    """
    for command in app.registered_commands:
        name = command.name or str(getattr(command.callback, "__name__", "")).replace("_", "-")
        examples = given.get(f"{within} {name}") or given.get(name)
        if examples:
            command.epilog = _epilog(examples)
    for group in app.registered_groups:
        part = group.typer_instance
        if part is None:
            continue
        title = part.info.name if isinstance(part.info.name, str) else ""
        if title in given:
            part.info.epilog = _epilog(given[title])
        _add_examples(part, given, title or within)


def _epilog(examples: Examples) -> str:
    """Format examples as separate lines of the help."""
    return "\n\n".join(f"gazerig {text}   ({what})" for text, what in examples)

"""The group of all commands, which imports only the module of the typed command."""

from collections import UserDict
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from gazerig.drivers.plugins import COMMAND, SHIPPED, find
from gazerig.robot.cli.command_list import (
    CommandEntry,
    in_order,
    package_commands,
    shipped_commands,
)
from gazerig.robot.cli.examples import EXAMPLES, add_examples
from gazerig.robot.cli.terminal import clear_errors


class CommandsByName(UserDict[str, Any]):
    """Commands by name, each imported when it is taken out.

    data: those imported until now; the others have a name, summary and panel only
    """

    def __init__(self) -> None:
        super().__init__()
        self._imported: set[str] = set()
        self.entries: dict[str, CommandEntry] = {}
        self._add(shipped_commands())

    def add_packages(self) -> None:
        """Add the commands of installed packages; names that are taken stay as they are."""
        self._add(package_commands())

    def _add(self, entries: Mapping[str, CommandEntry]) -> None:
        self.entries = {**entries, **self.entries}
        for name, entry in entries.items():
            listed = TyperCommand(name, help=entry.summary, rich_help_panel=entry.panel)
            self.data.setdefault(name, listed)

    def __getitem__(self, name: str) -> Any:
        """Return a whole command; raise KeyError if there is none of this name."""
        if name in self.data and name not in self._imported:
            app = typer.Typer()
            app.add_typer(import_module(self.entries[name].module).app)
            add_examples(app, {**EXAMPLES, **self.entries[name].examples})
            command: Any = typer.main.get_group(app).commands[name]
            command.rich_help_panel = self.entries[name].panel
            self.data[name] = command
            self._imported.add(name)
        return self.data[name]


class CommandGroup(TyperGroup):
    """Lists the commands panel by panel, and imports one to run it or show its help."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = self._every = CommandsByName()

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        self._every.add_packages()
        return in_order(self._every.entries)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command as far as a list of all needs it, None if there is none of this name."""
        if cmd_name not in self._every.data:
            self._every.add_packages()
        if cmd_name not in self._every.data and cmd_name in SHIPPED[COMMAND]:
            with clear_errors():
                find(COMMAND, cmd_name).load()  # its feature is missing: one line
        return self._every.data.get(cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name and the whole command that the arguments begin with, and the rest."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, self._every[name] if name is not None else command, rest

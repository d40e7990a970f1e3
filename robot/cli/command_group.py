"""The group of all commands, which imports the module of the one that was typed."""

from collections import UserDict
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from gazerig.robot.cli.command_list import COMMANDS, PANELS
from gazerig.robot.cli.examples import add_examples


class CommandsByName(UserDict[str, Any]):
    """Commands by name, each imported when it is taken out.

    data: those imported so far; of the others only name, summary and panel
    """

    def __init__(self) -> None:
        super().__init__()
        for panel, entries in PANELS.items():
            for name, entry in entries.items():
                self.data[name] = TyperCommand(name, help=entry.summary, rich_help_panel=panel)
        self._imported: set[str] = set()

    def __getitem__(self, name: str) -> Any:
        """Return a whole command; raise KeyError if there is none of this name."""
        if name in self.data and name not in self._imported:
            app = typer.Typer()
            app.add_typer(import_module(f"gazerig.robot.cli.{COMMANDS[name].module}").app)
            add_examples(app)
            self.data[name] = typer.main.get_group(app).commands[name]
            self._imported.add(name)
        return self.data[name]


class CommandGroup(TyperGroup):
    """Lists the commands as ``PANELS`` does, and imports one when it is run or asked about."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = self._every = CommandsByName()

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        return list(self._every)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command as far as a list of all needs it, None if there is none of this name."""
        return self._every.data.get(cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name and the whole command that the arguments begin with, and the rest."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, self._every[name] if name is not None else command, rest

"""The command ``gazerig`` with its options, and its output without a command.

Only the module of the typed command is imported. Without arguments, next steps are printed.
"""

import logging
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

import gazerig
from gazerig.drivers.plugins import COMMAND, SHIPPED, find
from gazerig.robot.cli.command_list import Commands
from gazerig.robot.cli.terminal import DEBUG_LOGGER, clear_errors, run_app

NEXT_STEPS = """\
gazerig makes an animatronic head look at people. What next?

Without hardware:
  gazerig run --mock                    a head looks at a visitor, in your browser
  gazerig report --scene face-to-face   compare that gaze with people's, in one HTML file
  gazerig new my.yaml                   your own rig file; lists boards, joints and cameras

With a servo adapter (docs/start.md lists suitable ones):
  gazerig scan                          which servos answer; changes nothing
  gazerig check my.yaml                 check your file
  gazerig doctor my.yaml                check port and servos against it; every fault has a remedy
  gazerig run my.yaml --oak             go

While a rig runs:
  gazerig ctl get                       all parameters, and which are not saved yet
  gazerig stop                          torque off immediately

All commands: gazerig --help    one of them, with examples: gazerig run --help
"""


class CommandGroup(TyperGroup):
    """A group that lists commands by panel, and imports one to run it or show its help."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = self._every = Commands()

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        self._every.add_packages()
        return self._every.names()

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command with the data for a list, None if the name is unknown."""
        if cmd_name not in self._every.entries:
            self._every.add_packages()
        entry = self._every.entries.get(cmd_name)
        if entry is not None:
            return TyperCommand(cmd_name, help=entry.summary, rich_help_panel=entry.panel)
        if cmd_name in SHIPPED[COMMAND]:
            with clear_errors():
                find(COMMAND, cmd_name).load()  # its feature is missing: one line
        return None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name and the complete command at the start of the arguments, and the rest."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, self._every[name] if name is not None else command, rest


app = typer.Typer(
    cls=CommandGroup,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"gazerig {gazerig.__version__}")
        raise typer.Exit


@app.callback()
def begin(
    context: typer.Context,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error, with any command.")
    ] = False,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version and exit.", callback=_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Make an animatronic head look at people as people look at each other."""
    if context.invoked_subcommand is None:
        print(NEXT_STEPS, end="")


def main() -> None:
    """Run the command line: an error is one line; --debug adds its traceback."""
    arguments = sys.argv[1:]
    if "--debug" in arguments:  # at any position
        arguments = [word for word in arguments if word != "--debug"]
        logging.getLogger(DEBUG_LOGGER).setLevel(logging.DEBUG)
    run_app(app, arguments, "repeat it with --debug and report the output")

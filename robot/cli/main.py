"""The command ``gazerig`` with its options, and its output without a command.

Only the module of the typed command is imported. Without arguments, next steps are printed.
"""

import logging
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

import gazerig
from gazerig.drivers.plugins import COMMAND, SHIPPED, find
from gazerig.robot.cli.command_list import Commands
from gazerig.robot.cli.terminal import DEBUG_LOGGER, clear_errors, run_app

if TYPE_CHECKING:
    from gazerig.drivers.serial.list_ports import SerialPort


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
        from gazerig.drivers.serial.list_ports import serial_ports
        from gazerig.robot.net.client import connect_to_all

        print(next_steps(serial_ports(), rig_files(), bool(connect_to_all())))


def main() -> None:
    """Run the command line: an error is one line; --debug adds its traceback."""
    arguments = sys.argv[1:]
    if "--debug" in arguments:  # at any position
        arguments = [word for word in arguments if word != "--debug"]
        logging.getLogger(DEBUG_LOGGER).setLevel(logging.DEBUG)
    run_app(app, arguments, "repeat it with --debug and report the output")


def rig_files() -> list[Path]:
    """Return the YAML files of this folder that look like rigs."""
    return [path for path in Path(".").glob("*.yaml") if _looks_like_a_rig(path)]


def _looks_like_a_rig(path: Path) -> bool:
    from gazerig.drivers.files.file_input import read_limited

    try:
        return b"joints:" in read_limited(path, 1_000_000)
    except OSError:
        return False


_BEGIN = (
    ("gazerig run --mock", "see a head look at a visitor in your browser; no hardware needed"),
    ("gazerig report --scene face-to-face", "compare that gaze with people's, in one HTML file"),
    ("gazerig new my.yaml", "your own rig file, from four questions"),
)


def next_steps(ports: "Iterable[SerialPort]", rigs: Iterable[Path], running: bool) -> str:
    """Return the useful next steps, as lines.

    ports: serial ports of this computer; rigs: rig files in this folder
    running: whether a rig is running on this computer
    """
    usb = [port for port in ports if port.usb]
    own = next(iter(sorted(rigs)), None)
    lines = ["gazerig makes an animatronic head look at people. What next?", ""]
    if running:
        lines += _block(
            "A rig is running here:",
            (
                ("gazerig ctl get", "all parameters, and which are not saved yet"),
                ("gazerig ctl set gaze.blink... VALUE", "change one; gazerig ctl save saves it"),
                ("gazerig stop", "torque off immediately"),
            ),
        )
    lines += _block("Without hardware:", _BEGIN)
    if usb and own is None:
        lines += _block(
            f"A servo adapter is plugged in ({usb[0].by_id or usb[0].device}):",
            ((f"gazerig scan --port {usb[0].device}", "which servos answer; changes nothing"),),
        )
    elif own is not None:
        lines += _block(
            f"With your rig {own}:",
            (
                (f"gazerig check {own}", "check the file"),
                (
                    f"gazerig doctor {own}",
                    "check port and servos against it; every fault has a remedy",
                ),
                (f"gazerig run {own} --oak", "go"),
            ),
        )
    else:
        lines += ["No USB serial adapter is plugged in; docs/start.md lists suitable ones.", ""]
    lines.append("All commands: gazerig --help    one of them, with examples: gazerig run --help")
    return "\n".join(lines)


def _block(title: str, commands: Iterable[tuple[str, str]]) -> list[str]:
    rows = tuple(commands)
    width = max(len(command) for command, _ in rows)
    return [title, *(f"  {command:{width}}  {what}" for command, what in rows), ""]

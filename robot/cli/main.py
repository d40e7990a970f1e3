"""The command ``gazerig``: what people type, and what they read on the terminal."""

import logging
import sys
from pathlib import Path
from typing import Annotated

import typer

import gazerig
from gazerig.robot.cli.command_group import CommandGroup
from gazerig.robot.cli.terminal import DEBUG_LOGGER, run_app

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
        bool, typer.Option("--debug", help="Show where an error comes from, with any command.")
    ] = False,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version and end.", callback=_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Makes an animatronic head look at people the way people look at each other."""
    if context.invoked_subcommand is None:
        from gazerig.drivers.serial.list_ports import serial_ports
        from gazerig.robot.cli.welcome import next_steps
        from gazerig.robot.remote.client import running

        print(next_steps(serial_ports(), rig_files(), bool(running())))


def main() -> None:
    """Run the command line: an error is one line, with --debug also its traceback."""
    arguments = sys.argv[1:]
    if "--debug" in arguments:  # wherever people put it
        arguments = [word for word in arguments if word != "--debug"]
        logging.getLogger(DEBUG_LOGGER).setLevel(logging.DEBUG)
    run_app(app, arguments, "say it again with --debug and report what it shows")


def rig_files() -> list[Path]:
    """Return the YAML files of this folder that look like rigs."""
    return [path for path in Path(".").glob("*.yaml") if _looks_like_a_rig(path)]


def _looks_like_a_rig(path: Path) -> bool:
    from gazerig.drivers.files.file_input import read_limited

    try:
        return b"joints:" in read_limited(path, 1_000_000)
    except OSError:
        return False

"""Command emulate: servos on a pseudo-terminal, which any program can open."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.terminal import clear_errors
from gazerig.robot.run.emulated import emulated_lines
from gazerig.sim_mock.device_spec import EXAMPLE, line_of
from gazerig.sim_mock.devices import Emulated
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import ServerSettings, run, say

app = typer.Typer()

BAUD = 1_000_000


@app.command()
def emulate(
    rig: Annotated[
        str | None,
        typer.Argument(
            metavar="RIG",
            help="Emulate all buses of a rig, each with its own terminal.",
        ),
    ] = None,
    servos: Annotated[
        str | None,
        typer.Option(
            metavar="IDS:MODEL,...",
            help=f"The servos of one line, for example {EXAMPLE}, or 1-6:sts3215.",
        ),
    ] = None,
    link: Annotated[
        Path | None,
        typer.Option(
            help="Path under which it can be opened, also after unplug and plug. "
            "Further buses of a rig add their names: LINK-NAME."
        ),
    ] = None,
) -> None:
    """Emulate servos on a pseudo-terminal; print its path as JSON and accept fault commands.

    Type `help` for the commands; Ctrl-C ends it.
    """
    with clear_errors(rig):
        if (servos is None) == (rig is None):
            raise SetupError(f"name a rig, or its servos: --servos {EXAMPLE}")
        devices: dict[str, Emulated]
        if servos is not None:
            devices = {"": line_of(servos, BAUD)}
        else:
            devices = emulated_lines(load_rig(rig or ""))
        buses = tuple(
            BusSettings(
                device,
                name or None,
                link=None if link is None else f"{link}-{name}" if name else str(link),
            )
            for name, device in devices.items()
        )
        try:
            run(ServerSettings(buses), say, heed_ctrl_c=True)
        except ValueError as error:
            raise SetupError(str(error)) from None

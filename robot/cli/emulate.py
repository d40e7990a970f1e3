"""Command emulate: servos on a pseudo-terminal, which any program can open."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from gazerig.config.schema import load_rig
from gazerig.drivers.dynamixel.control_table import BAUD_RATES as DYNAMIXEL_BAUDS
from gazerig.drivers.errors import SetupError
from gazerig.drivers.feetech.memory_table import BAUD_RATES as FEETECH_BAUDS
from gazerig.drivers.maestro.board import MaestroParams
from gazerig.params import choices_of
from gazerig.robot.cli.terminal import clear_errors, complete_rig
from gazerig.robot.run.emulated import emulated_lines
from gazerig.sim_mock.device_spec import EXAMPLE, line_of
from gazerig.sim_mock.devices import DynamixelLine, Emulated, FeetechLine, MaestroLine, Pca9685Line
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import ServerSettings, run
from gazerig.sim_mock.pty.server import say as say_line

app = typer.Typer()

DEFAULT_BAUD = 1_000_000
_BAUDS: dict[str, tuple[int, ...]] = {"dynamixel": DYNAMIXEL_BAUDS, "feetech": FEETECH_BAUDS}
_CHANNELS: tuple[int, ...] = choices_of(MaestroParams, "channels")


@app.command()
def emulate(
    rig: Annotated[
        str | None,
        typer.Argument(
            metavar="RIG",
            help="Emulate all buses of a rig, each with its own terminal.",
            autocompletion=complete_rig,
        ),
    ] = None,
    servos: Annotated[
        str | None,
        typer.Option(
            metavar="IDS:MODEL,...",
            help=f"The servos of one line, for example {EXAMPLE}, or 1-6:sts3215.",
        ),
    ] = None,
    maestro: Annotated[
        int | None,
        typer.Option(
            metavar="CHANNELS",
            help="A Pololu Maestro with a hobby servo on each of its 6, 12, 18 or 24 channels.",
        ),
    ] = None,
    pca9685: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS,...",
            help="PCA9685 boards behind an I2C bridge, with a hobby servo on each channel: 0x40.",
        ),
    ] = None,
    link: Annotated[
        Path | None,
        typer.Option(
            help="Path under which it can be opened, also after unplug and plug. "
            "Further buses of a rig add their names: LINK-NAME."
        ),
    ] = None,
    baud: Annotated[
        int | None,
        typer.Option(
            help=f"Baud rate of smart servos in bit/s (default {DEFAULT_BAUD}, or the rig's)."
        ),
    ] = None,
    wire_time: Annotated[
        bool, typer.Option("--wire-time", help="Simulate the time of bytes on the line.")
    ] = False,
    until_eof: Annotated[
        bool, typer.Option("--until-eof", help="Stop at the end of standard input.")
    ] = False,
) -> None:
    """Emulate servos on a pseudo-terminal; print its path as JSON and accept fault commands.

    Type `help` for the commands; Ctrl-C ends it.
    """
    with clear_errors(rig):
        if sum(one is not None for one in (servos, maestro, pca9685, rig)) != 1:
            raise SetupError(
                f"name a rig, or its servos: --servos {EXAMPLE}, --maestro 12 or --pca9685 0x40"
            )
        devices: dict[str, Emulated]
        if servos is not None:
            devices = {"": line_of(servos, DEFAULT_BAUD)}
        elif maestro is not None:
            if maestro not in _CHANNELS:
                sizes = ", ".join(map(str, _CHANNELS))
                raise SetupError(f"--maestro {maestro}: a board has {sizes} channels")
            devices = {"": MaestroLine(maestro)}
        elif pca9685 is not None:
            devices = {"": _parse_boards(pca9685)}
        else:
            devices = emulated_lines(load_rig(rig or ""))
        devices = {name: _at_rate(device, baud) for name, device in devices.items()}
        several = len(devices) > 1
        if baud is not None and several:
            raise SetupError("--baud: the buses of this rig have their own rates; see its file")
        buses = tuple(
            BusSettings(
                device,
                name if several else None,
                wire_time,
                None if link is None else f"{link}-{name}" if several and name else str(link),
            )
            for name, device in devices.items()
        )
        say = _print_answer if sys.stdout.isatty() else say_line
        try:
            run(ServerSettings(buses, until_eof), say, heed_ctrl_c=True)
        except ValueError as error:
            raise SetupError(str(error)) from None


def _parse_boards(text: str) -> Pca9685Line:
    try:
        return Pca9685Line(tuple(int(one, 16) for one in text.split(",")))
    except ValueError:
        raise SetupError(
            f"--pca9685 {text}: not addresses in hexadecimal, such as 0x40 or 0x40,0x41"
        ) from None


def _at_rate(device: Emulated, baud: int | None) -> Emulated:
    """Return smart servos with another baud rate; None keeps their own."""
    if baud is None or not isinstance(device, DynamixelLine | FeetechLine):
        return device
    known = _BAUDS[device.kind]
    if baud not in known:
        rates = ", ".join(map(str, known))
        raise SetupError(f"--baud {baud}: servos of this kind know {rates}")
    return replace(device, baud=baud)


def _print_answer(line: str) -> None:
    """Print an answer; on a terminal, long texts are printed as they are, not as JSON."""
    answer = json.loads(line)
    text = answer.get("ok", answer.get("error", ""))
    print(text if "\n" in text else line, flush=True)

"""The command ``gazerig emulate``: servos on a pseudo-terminal, for any program to open."""

import json
import re
import sys
from pathlib import Path
from typing import Annotated

import typer

from config.schema import load_rig
from drivers.dynamixel_table import BAUD_RATES, MODELS
from drivers.errors import SetupError
from robot.cli.terminal import clear_errors
from robot.types import JOINTS
from sim_mock.emulate import Settings, run
from sim_mock.emulate import say as say_line
from sim_mock.servo import ServoSpec
from sim_mock.servo_habits import cases

app = typer.Typer()

DEFAULT_BAUD = 1_000_000
DEFAULT_FIRMWARE = ServoSpec(1, "xl330-m077").firmware
MIDDLE = 2048
HIGHEST_ID = 252
EXAMPLE = "1-6:xl330-m077,7-9:xc330-m288"

_PART = re.compile(r"(\d+)(?:-(\d+))?:([^@]+)(?:@(\d+))?")


@app.command()
def emulate(
    servos: Annotated[
        str | None,
        typer.Option(metavar="IDS:MODEL,...", help=f"The servos, for example {EXAMPLE}."),
    ] = None,
    rig: Annotated[
        str | None, typer.Option(help="The servos and the baud rate of a rig instead.")
    ] = None,
    link: Annotated[
        Path | None,
        typer.Option(help="Name under which to open it; kept over unplug and plug."),
    ] = None,
    baud: Annotated[
        int | None,
        typer.Option(help=f"Baud rate of the servos in bit/s (default {DEFAULT_BAUD})."),
    ] = None,
    any_baud: Annotated[
        bool, typer.Option("--any-baud", help="Hear clients at every baud rate.")
    ] = False,
    wire_time: Annotated[
        bool, typer.Option("--wire-time", help="Bytes take their time on the line.")
    ] = False,
    turnaround_us: Annotated[
        float, typer.Option(min=0.0, max=10_000.0, help="With wire time: before each status.")
    ] = 0.0,
    firmware: Annotated[
        int, typer.Option(min=1, max=255, help="Firmware version of all servos.")
    ] = DEFAULT_FIRMWARE,
    case: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="CASE=VALUE", help=f"Choices: {', '.join(cases())}."),
    ] = None,
    until_eof: Annotated[
        bool, typer.Option("--until-eof", help="End when standard input ends.")
    ] = False,
) -> None:
    """Emulate servos on a pseudo-terminal; prints its path as JSON, takes fault commands.

    Type `help` for the commands; Ctrl-C ends it.
    """
    with clear_errors():
        if (servos is None) == (rig is None):
            raise SetupError(f"name the servos: --servos {EXAMPLE}, or --rig NAME")
        specs, rate = _of_rig(rig, firmware) if rig else (parse_servos(servos or "", firmware), 0)
        settings = Settings(
            servos=specs,
            baud=None if any_baud else _known_baud(baud or rate or DEFAULT_BAUD),
            wire_time=wire_time,
            turnaround_us=turnaround_us,
            link=None if link is None else str(link),
            until_eof=until_eof,
            choices=_choices(case or []),
        )
        try:
            run(settings, _plain if sys.stdout.isatty() else say_line, heed_ctrl_c=True)
        except ValueError as error:
            raise SetupError(str(error)) from None


def parse_servos(text: str, firmware: int) -> tuple[ServoSpec, ...]:
    """Read servos such as ``1-6:xl330-m077,7:xc330-m288@1024`` (@: start position in steps).

    Raises:
        SetupError: names the part that is wrong and what would be right.
    """
    specs: dict[int, ServoSpec] = {}
    for part in text.split(","):
        found = _PART.fullmatch(part.strip())
        if found is None:
            raise SetupError(f"--servos {part!r}: not IDS:MODEL, for example {EXAMPLE}")
        first, last = int(found[1]), int(found[2] or found[1])
        model, start = found[3].lower(), int(found[4] or MIDDLE)
        if not first <= last <= HIGHEST_ID:
            raise SetupError(f"--servos {part!r}: ids run upwards, from 0 to {HIGHEST_ID}")
        if model not in MODELS:
            raise SetupError(f"--servos {part!r}: unknown model; there is {', '.join(MODELS)}")
        for servo_id in range(first, last + 1):
            if servo_id in specs:
                raise SetupError(
                    f"--servos {part!r}: id {servo_id} is taken by a {specs[servo_id].model}; "
                    "ids must differ (the command `collide` makes a collision)"
                )
            specs[servo_id] = ServoSpec(servo_id, model, start, firmware)
    return tuple(specs.values())


def _of_rig(name: str, firmware: int) -> tuple[tuple[ServoSpec, ...], int]:
    """Give the servos of a rig, each in the middle of its joint's range, and their baud rate."""
    rig = load_rig(name)
    joints = [rig.joints[joint] for joint in JOINTS]
    specs = [ServoSpec(j.id, j.model, round(j.steps(0.0)), firmware) for j in joints]
    return tuple(specs), rig.bus.dynamixel.baud


def _known_baud(baud: int) -> int:
    if baud not in BAUD_RATES:
        raise SetupError(f"--baud {baud}: servos know {', '.join(map(str, BAUD_RATES))}")
    return baud


def _choices(given: list[str]) -> dict[str, str]:
    pairs = [text.partition("=") for text in given]
    for text, (_, equals, value) in zip(given, pairs, strict=True):
        if not equals or not value:
            raise SetupError(f"--set {text}: not CASE=VALUE; cases: {', '.join(cases())}")
    return {name: value for name, _, value in pairs}


def _plain(line: str) -> None:
    """Show an answer to a person at a terminal: long texts as they are."""
    answer = json.loads(line)
    text = answer.get("ok", answer.get("error", ""))
    print(text if "\n" in text else line, flush=True)

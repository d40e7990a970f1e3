"""Options of the command emulate, with their help."""

from pathlib import Path
from typing import Annotated

import typer

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.robot.cli.terminal import complete_rig
from gazerig.sim_mock.device_cases import CASES
from gazerig.sim_mock.device_spec import DEFAULT_FIRMWARE, EXAMPLE

DEFAULT_BAUD = 1_000_000
_NAMES: dict[BusKind, str] = {
    "dynamixel": "Dynamixel servos",
    "feetech": "STS servos",
    "maestro": "a Maestro",
    "pca9685": "PCA9685 boards",
}

Rig = Annotated[
    str | None,
    typer.Argument(
        metavar="RIG",
        help="Emulate all buses of a rig, each with its own terminal.",
        autocompletion=complete_rig,
    ),
]
Servos = Annotated[
    str | None,
    typer.Option(
        metavar="IDS:MODEL,...",
        help=f"The servos of one line, for example {EXAMPLE}, or 1-6:sts3215.",
    ),
]
Maestro = Annotated[
    int | None,
    typer.Option(
        metavar="CHANNELS",
        help="A Pololu Maestro with a hobby servo on each of its 6, 12, 18 or 24 channels.",
    ),
]
Pca9685 = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS,...",
        help="PCA9685 boards behind an I2C bridge, with a hobby servo on each channel: 0x40.",
    ),
]
Link = Annotated[
    Path | None,
    typer.Option(
        help="Path under which it can be opened, also after unplug and plug. "
        "Further buses of a rig add their names: LINK-NAME."
    ),
]
Baud = Annotated[
    int | None,
    typer.Option(
        help=f"Baud rate of smart servos in bit/s (default {DEFAULT_BAUD}, or the rig's)."
    ),
]
AnyBaud = Annotated[bool, typer.Option("--any-baud", help="Answer clients at every baud rate.")]
WireTime = Annotated[
    bool, typer.Option("--wire-time", help="Simulate the time of bytes on the line.")
]
TurnaroundUs = Annotated[
    float,
    typer.Option(
        min=0.0, max=10_000.0, help="With wire time: additional delay before each answer."
    ),
]
Firmware = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=255,
        help=f"Firmware version of all servos (default {DEFAULT_FIRMWARE}); for STS servos "
        "the number after 3.",
    ),
]
Crc = Annotated[
    bool, typer.Option("--crc", help="With --maestro: it requires a CRC after every command.")
]
Case = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="CASE=VALUE",
        help="Choices. "
        + " ".join(f"Of {_NAMES[kind]}: {', '.join(CASES[kind])}." for kind in CASES),
    ),
]
UntilEof = Annotated[bool, typer.Option("--until-eof", help="Stop at the end of standard input.")]

"""The way to the servos that commands share: a rig, its port, another port, or an emulated bus."""

import contextlib
from collections.abc import Iterator, Sequence
from typing import Annotated, NamedTuple

import typer

from config.schema import Rig
from drivers.dynamixel_registers import Registers
from drivers.errors import PortError, SetupError
from drivers.serial_port import BlockingPort
from robot.emulated_rig import emulated_servos
from sim_mock.pty_bus import PtyBus
from sim_mock.servo_physics import ServoSpec

MockOption = Annotated[
    bool, typer.Option("--mock", help="Emulated servo bus instead of the rig's.")
]
PortOption = Annotated[str | None, typer.Option(help="Serial port instead of the rig's.")]
RigOption = Annotated[
    str, typer.Option(metavar="RIG", help="A rig's YAML file, or the name of a shipped rig.")
]


class Wires(NamedTuple):
    """A serial port by path, and the emulated bus behind it where there is one."""

    path: str
    bus: PtyBus | None


@contextlib.contextmanager
def wires(
    rig: Rig,
    mock: bool,
    port: str | None,
    servos: Sequence[ServoSpec] | None = None,
    baud: int | None = None,
) -> Iterator[Wires]:
    """Give the port to open; an emulated bus ends with the block.

    servos, baud: emulated ones instead of the rig's

    Raises:
        drivers.errors.SetupError: the options exclude each other.
    """
    if mock and port is not None:
        raise SetupError("--port and --mock exclude each other: --mock has a port of its own")
    if not mock:
        yield Wires(port if port is not None else rig.bus.port, None)
        return
    with PtyBus() as bus:
        chain = servos if servos is not None else emulated_servos(rig)
        yield Wires(bus.start(chain, baud=baud or rig.bus.dynamixel.baud), bus)


@contextlib.contextmanager
def registers(rig: Rig, path: str, tries: int = 3) -> Iterator[tuple[Registers, BlockingPort]]:
    """Open a port for single registers at the rig's baud rate; nothing is sent.

    Raises:
        drivers.errors.PortError: it is absent, busy, not permitted, or has no such rate.
    """
    port, baud = BlockingPort(path), rig.bus.dynamixel.baud
    if not port.setBaudRate(baud):
        raise PortError(f"{path} cannot run at {baud} bit/s: choose 57600 or 1000000")
    try:
        yield Registers(port, tries), port
    finally:
        port.closePort()

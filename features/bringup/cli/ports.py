"""The way to the servos that commands share: a rig, its ports, other ports, or emulated buses."""

import contextlib
from collections.abc import Iterator, Mapping
from typing import Annotated, NamedTuple

import typer

from gazerig.config.rig import Rig
from gazerig.drivers.errors import PortError, SetupError
from gazerig.drivers.plugins import BUS, find, is_ours
from gazerig.drivers.serial.list_ports import serial_ports
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.port_by_path import port_of
from gazerig.drivers.serial.port_owner import refuse_owner
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.cli.progress import to_open
from gazerig.robot.app.bus_wiring import bus_names, joints_on, ports_of, rig_setups
from gazerig.robot.app.emulation import emulated_lines
from gazerig.robot.guardian.guardian import Guardian
from gazerig.sim_mock.devices import Emulated
from gazerig.sim_mock.pty.client import PtyBuses

MockOption = Annotated[
    bool, typer.Option("--mock", help="Emulated servo bus instead of the rig's.")
]
PortOption = Annotated[
    str | None,
    typer.Option(
        metavar="PORT", help="Serial port instead of the rig's; NAME=PORT for a further bus."
    ),
]


class RigPorts(NamedTuple):
    """Serial ports by the names of their buses, and what is emulated behind them, if it is."""

    paths: Mapping[str, str]
    buses: PtyBuses | None

    def opened_by(self) -> dict[str, BusPort]:
        """Return the ports, not opened yet."""
        return {name: port_of(path) for name, path in self.paths.items()}

    def command(self, text: str, bus: str) -> None:
        """Send a command to the emulator of a bus; without effect on real ports.

        Raises:
            ValueError: names the word that is wrong and what would be right.
        """
        if self.buses is not None:
            self.buses.command(text, bus)


def refuse_packages(rig: Rig, command: str) -> None:
    """Refuse a command that speaks to servos of our kinds alone.

    Raises:
        SetupError: a bus of the rig is another package's.
    """
    for name in bus_names(rig):
        kind = rig.bus_named(name).kind
        if not is_ours(BUS, kind):
            label = find(BUS, kind).label
            raise SetupError(f"{command} cannot ask the {label}: run, jog, home and look-at can")


@contextlib.contextmanager
def rig_ports(
    rig: Rig, mock: bool, port: str | None, devices: Mapping[str, Emulated] | None = None
) -> Iterator[RigPorts]:
    """Return the ports to open; emulated buses end with the block.

    devices: what is emulated on some buses instead of the rig's servos

    Raises:
        SetupError: the options exclude each other, or name no bus of the rig.
        PortError: a port's owner would take servo packets for commands.
    """
    if mock and port is not None:
        raise SetupError("--port and --mock exclude each other: --mock has a port of its own")
    if not mock:
        paths, here = ports_of(rig, port), serial_ports()
        for name, path in paths.items():
            refuse_owner(path, rig.bus_named(name).kind, here)
        yield RigPorts(paths, None)
        return
    with PtyBuses() as buses:
        lines = {**emulated_lines(rig), **(devices or {})}
        yield RigPorts(buses.start(lines), buses)


def bus_label(rig: Rig, name: str) -> str:
    """Call a bus by its name where a rig has several: "the bus", "bus lids"."""
    if len(bus_names(rig)) == 1:
        return "the bus"
    return f"bus {name}" if name else "the main bus"


def setups_on(rig: Rig, name: str) -> tuple[ServoConfig, ...]:
    """Return what a bus must know of its servos, in the order of the joints."""
    every = dict(zip(rig.names, rig_setups(rig), strict=True))
    return tuple(every[joint] for joint in joints_on(rig, name))


@contextlib.contextmanager
def opened(
    rig: Rig, ports: RigPorts, bus: str, guardian: Guardian | None = None
) -> Iterator[BusPort]:
    """Open the port of the bus of this name at its speed; nothing is sent.

    guardian: is shown a sign of life with all that is sent

    Raises:
        PortError: it is absent, busy, not permitted, or has no such speed.
    """
    baud = rig.bus_named(bus).baud
    with to_open(ports.paths[bus], guardian.beat if guardian is not None else None) as port:
        if not port.setBaudRate(baud):
            raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose another")
        yield port

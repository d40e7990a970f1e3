"""Access to servos that commands share: a rig, its ports, other ports, or emulated buses."""

import contextlib
import sys
from collections.abc import Iterator, Mapping
from typing import Annotated, NamedTuple

import typer

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.plugins import BUS, find, is_ours
from gazerig.drivers.serial.list_ports import check_owner, serial_ports, usb_id_of
from gazerig.drivers.serial.port import BusPort, port_at_path
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.servo_setup import open_at
from gazerig.robot.cli.progress import Console
from gazerig.robot.cli.terminal import confirm, say, status
from gazerig.robot.run.buses import bus_ports
from gazerig.robot.run.emulated import emulated_lines
from gazerig.robot.run.rig_limits import bus_names, joints_on, servo_configs
from gazerig.sim_mock.devices import Emulated
from gazerig.sim_mock.pty.client import PtyBuses

YesOption = Annotated[bool, typer.Option("--yes", help="Answer yes to every question.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one line of JSON instead of text.")]


def usb_id(path: str) -> str:
    """Return the USB vendor and product id of a port, "" if it has none."""
    return usb_id_of(path, serial_ports())


@contextlib.contextmanager
def unopened_port(path: str) -> Iterator[BusPort]:
    """Return a port that is not opened yet, closed again at the end."""
    line = port_at_path(path)
    try:
        yield line
    finally:
        line.closePort()


def console() -> Console:
    """Return the console for results; the terminal wraps long lines."""
    return Console(soft_wrap=True, highlight=False)


def progress(line: str = "") -> None:
    """Show the present activity on a terminal only, nothing without a line."""
    if sys.stderr.isatty():
        status(line)


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
    """Serial ports by the names of their buses, and the emulated devices, if any."""

    paths: Mapping[str, str]
    buses: PtyBuses | None


def refuse_packages(rig: Rig, command: str) -> None:
    """Refuse a command that supports only the built-in kinds of servos.

    Raises:
        SetupError: a bus of the rig belongs to another package.
    """
    for name in bus_names(rig):
        kind = rig.bus_named(name).kind
        if not is_ours(BUS, kind):
            label = find(BUS, kind).label
            raise SetupError(f"{command} cannot ask the {label}: run and jog can")


@contextlib.contextmanager
def rig_ports(
    rig: Rig, mock: bool, port: str | None, devices: Mapping[str, Emulated] | None = None
) -> Iterator[RigPorts]:
    """Return the ports to open; emulated buses end with the block.

    devices: devices emulated on some buses instead of the rig's servos

    Raises:
        SetupError: the options are contradictory, or name an unknown bus.
        PortError: the device on a port would interpret servo packets as commands.
    """
    if mock and port is not None:
        raise SetupError("--port and --mock exclude each other: --mock has a port of its own")
    if not mock:
        paths, here = bus_ports(rig, port), serial_ports()
        for name, path in paths.items():
            check_owner(path, rig.bus_named(name).kind, here)
        yield RigPorts(paths, None)
        return
    with PtyBuses() as buses:
        lines = {**emulated_lines(rig), **(devices or {})}
        yield RigPorts(buses.start(lines), buses)


def bus_label(rig: Rig, name: str) -> str:
    """Return the name of a bus: "the bus" if it is the only one, or "bus lids"."""
    if len(bus_names(rig)) == 1:
        return "the bus"
    return f"bus {name}" if name else "the main bus"


def setups_on(rig: Rig, name: str) -> tuple[ServoConfig, ...]:
    """Return the setups of the servos on a bus, in the order of the joints."""
    every = dict(zip(rig.names, servo_configs(rig), strict=True))
    return tuple(every[joint] for joint in joints_on(rig, name))


@contextlib.contextmanager
def open_port(rig: Rig, ports: RigPorts, bus: str) -> Iterator[BusPort]:
    """Open the port of the bus of this name at its speed; nothing is sent.

    Raises:
        PortError: it is absent, busy, not permitted, or does not support the speed.
    """
    with unopened_port(ports.paths[bus]) as port:
        open_at(port, rig.bus_named(bus).section.baud)
        yield port


def confirm_safe(why: str, remedy: str, question: str, yes: bool) -> None:
    """Warn of a movement, and ask for a confirmation.

    Args:
        why: the planned motion.
        remedy: required preparation by the user.
        question: question with the answers yes or no.
        yes: whether the answer is already yes.

    Raises:
        SetupError: no user can answer.
        typer.Abort: the answer was no.
    """
    if not yes and not sys.stdin.isatty():
        raise SetupError(f"{why}: {remedy} and say --yes")
    say(why)
    if not yes:
        confirm(question, abort=True)

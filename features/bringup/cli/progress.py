"""What the bring-up commands share: this computer's ports, one opened port, progress, options."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Annotated

import typer
from rich.console import Console

from gazerig.drivers.serial.list_ports import Host, SerialPort, serial_ports
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.serial.port_by_path import port_of
from gazerig.drivers.serial.port_owner import usb_of
from gazerig.robot.cli.terminal import status

host = Host()
"""Where this computer tells about its ports."""

YesOption = Annotated[bool, typer.Option("--yes", help="Yes to every question.")]
JsonOption = Annotated[bool, typer.Option("--json", help="One line of JSON instead of words.")]


def ports_here() -> tuple[SerialPort, ...]:
    """List the serial ports of this computer."""
    return serial_ports(host)


def usb_id(path: str) -> str:
    """Return the USB vendor and product id of a port, "" where it has none."""
    return usb_of(path, ports_here())


@contextlib.contextmanager
def to_open(path: str, on_traffic: Callable[[], None] | None = None) -> Iterator[BusPort]:
    """Return a port that is not opened yet, closed again at the end.

    on_traffic: called whenever bytes are sent or waited for
    """
    line = port_of(path, on_traffic=on_traffic)
    try:
        yield line
    finally:
        line.closePort()


def console() -> Console:
    """Return the place for results; long lines are the terminal's business."""
    return Console(soft_wrap=True, highlight=False)


def progress(line: str) -> None:
    """Show what is being done, on a terminal only."""
    if sys.stderr.isatty():
        status(line)


def wipe() -> None:
    """Remove the progress line."""
    if sys.stderr.isatty():
        status("")

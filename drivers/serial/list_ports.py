"""Serial ports and I2C buses of this computer, and why one cannot be opened.

No port is opened here.
"""

import errno
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from serial.tools import list_ports

from gazerig.drivers.errors import PortError

BY_ID = Path("/dev/serial/by-id")
"""Folder of links named after the adapter, which persist when it is replugged."""

POLOLU = "1ffb:"
"""USB vendor of Pololu."""


class SerialPort(NamedTuple):
    """A serial port.

    device: path to open; by_id: its persistent name, None if it has none
    usb: USB vendor and product id, "0403:6014"; "" for a port that is not on USB
    """

    device: str
    description: str
    usb: str
    by_id: str | None


def serial_ports(by_id: Path = BY_ID) -> tuple[SerialPort, ...]:
    """Return the serial ports, those on USB first."""
    ports = [
        SerialPort(
            port.device,
            port.description,
            f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None else "",
            persistent_name(port.device, by_id),
        )
        for port in list_ports.comports()
    ]
    return tuple(sorted(ports, key=lambda port: (not port.usb, port.device)))


def persistent_name(device: str, by_id: Path = BY_ID) -> str | None:
    """Return the name of a port that persists when it is replugged; None without one."""
    real, links = os.path.realpath(device), sorted(by_id.glob("*"))
    return next((str(link) for link in links if os.path.realpath(link) == real), None)


def is_i2c(device: str) -> bool:
    """Return whether the name of a path is that of an I2C bus."""
    return re.fullmatch(r"i2c-\d+", os.path.basename(os.path.realpath(device))) is not None


def usb_id_of(device: str, ports: Sequence[SerialPort]) -> str:
    """Return the USB vendor and product id of a port, "" if it has none or is not listed."""
    real = os.path.realpath(device)
    return next((port.usb for port in ports if os.path.realpath(port.device) == real), "")


def open_failure_text(port_name: str, code: int | None) -> str:
    """Return in one line why a port or an I2C bus cannot be opened, with the remedy."""
    if code in (errno.EACCES, errno.EPERM):
        return (
            f"no permission to open {port_name}: join its group with "
            f"'sudo usermod -aG $(stat -c %G {port_name}) $USER' and log in again"
        )
    if code in (errno.EBUSY, errno.EAGAIN):
        return f"{port_name} is busy: close the other program that uses it"
    kind, remedy = "serial port", "plug the adapter in; ports here"
    here = [f"{port.device} ({port.description})" for port in list_ports.comports()]
    if is_i2c(port_name):
        kind = "I2C bus"
        remedy = "switch I2C on (Raspberry Pi: sudo raspi-config, Interface Options); buses here"
        here = sorted(map(str, Path("/dev").glob("i2c-*")))
    fault = f"no {kind} {port_name}"
    if code not in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        fault = f"cannot open {port_name} as {kind}"
    return f"{fault}: {remedy}: {', '.join(here) or 'none'}"


def check_exists(device: str) -> None:
    """Check that a port of this computer exists, without opening it.

    Raises:
        PortError: it does not exist.
    """
    if device.startswith("/dev/") and not Path(device).exists():
        raise PortError(open_failure_text(device, errno.ENOENT))


def check_owner(device: str, kind: str, ports: Sequence[SerialPort]) -> None:
    """Check that packets of this kind of bus may be sent to a port.

    Packets of smart servos begin with FF, which is a command to a Maestro that moves a servo.
    Source: Pololu Maestro User's Guide (0J40), section 5.c.

    Raises:
        PortError: the port belongs to a board whose servos they would move.
    """
    if is_i2c(device) and kind != "pca9685":
        raise PortError(
            f"{device} is an I2C bus, not a serial port: name the adaptor's port with --port or in "
            "the YAML, or set the kind of the bus to pca9685"
        )
    if kind != "maestro" and usb_id_of(device, ports).startswith(POLOLU):
        raise PortError(
            f"{device} is a board of Pololu: {kind} packets would move its servos; name the "
            "adaptor's port with --port or in the YAML, or set its kind to maestro"
        )

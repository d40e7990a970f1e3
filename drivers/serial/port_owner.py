"""Check of the device at a serial port by its USB vendor: servo packets must not reach a Maestro.

Packets of smart servos begin with FF, which is a command to a Maestro that moves a servo. Source:
Pololu Maestro User's Guide (0J40), section 5.c.
"""

import os
import re
from collections.abc import Sequence

from gazerig.drivers.errors import PortError
from gazerig.drivers.serial.list_ports import SerialPort

POLOLU = "1ffb:"
"""USB vendor of Pololu."""


def is_i2c(device: str) -> bool:
    """Return whether the name of a path is that of an I2C bus."""
    return re.fullmatch(r"i2c-\d+", os.path.basename(os.path.realpath(device))) is not None


def usb_id_of(device: str, ports: Sequence[SerialPort]) -> str:
    """Return the USB vendor and product id of a port, "" if it has none or is not listed."""
    real = os.path.realpath(device)
    return next((port.usb for port in ports if os.path.realpath(port.device) == real), "")


def check_owner(device: str, kind: str, ports: Sequence[SerialPort]) -> None:
    """Check that packets of this kind of bus may be sent to a port.

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

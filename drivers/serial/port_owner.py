"""The device behind a serial port, by its USB vendor: servo packets must not reach a Maestro.

To a Maestro FF, with which the packets of smart servos begin, is a command that moves a
servo. Source: Pololu Maestro User's Guide (0J40), section 5.c.
"""

import os
import re
from collections.abc import Sequence

from gazerig.drivers.errors import PortError
from gazerig.drivers.serial.list_ports import SerialPort

POLOLU = "1ffb:"
"""USB vendor of Pololu."""


def is_i2c(device: str) -> bool:
    """Return whether a path is by its name that of an I2C bus."""
    return re.fullmatch(r"i2c-\d+", os.path.basename(os.path.realpath(device))) is not None


def usb_of(device: str, ports: Sequence[SerialPort]) -> str:
    """Return the USB vendor and product id of a port, "" where it has none or is not listed."""
    real = os.path.realpath(device)
    return next((port.usb for port in ports if os.path.realpath(port.device) == real), "")


def refuse_owner(device: str, kind: str, ports: Sequence[SerialPort]) -> None:
    """Check that packets of this kind of bus may be sent to a port.

    Raises:
        PortError: it belongs to a board whose servos they would move.
    """
    if is_i2c(device) and kind != "pca9685":
        raise PortError(
            f"{device} is an I2C bus and no serial port: name the adaptor's port with --port or in "
            "the YAML, or say that the kind of the bus is pca9685"
        )
    if kind != "maestro" and usb_of(device, ports).startswith(POLOLU):
        raise PortError(
            f"{device} is a board of Pololu: {kind} packets would move what hangs on it; name the "
            "adaptor's port with --port or in the YAML, or say that it is a maestro"
        )

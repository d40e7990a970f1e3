"""Messages about serial ports that cannot be opened."""

import errno
import os

from serial.tools import list_ports

from gazerig.drivers.serial.list_ports import port_users


def explain(port_name: str, code: int | None) -> str:
    """Return in one line why a port cannot be opened, with the remedy."""
    if code == errno.ENOENT or code == errno.ENODEV or code == errno.ENXIO:
        return f"no serial port {port_name}: plug the adapter in; ports here: {name_ports()}"
    if code in (errno.EACCES, errno.EPERM):
        return (
            f"no permission to open {port_name}: join its group with "
            "'sudo usermod -aG dialout $USER' and log in again"
        )
    if code in (errno.EBUSY, errno.EAGAIN):
        held = ", ".join(port_users(port_name))
        who = f", {held}," if held else ""
        return f"{port_name} is busy: close the other program{who} that uses it"
    reason = os.strerror(code) if code else "not a serial port"
    return f"cannot open {port_name} ({reason}); ports here: {name_ports()}"


def name_ports() -> str:
    """Return the names of the serial ports as text."""
    ports = [f"{port.device} ({port.description})" for port in list_ports.comports()]
    return ", ".join(ports) or "none"

"""Serial ports of this computer: their permissions and the programs that use them.

No port is opened here. ``Host`` contains the system folders that are read, so that tests can use
others.
"""

import contextlib
import errno
import grp
import os
import re
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from serial.tools import list_ports

from gazerig.drivers.errors import PortError

RECOMMENDED_LATENCY_MS = 1


@dataclass(frozen=True, slots=True)
class Host:
    """System folders that describe ports.

    latency: one folder per USB serial device, with its latency_timer in ms
    by_id: links named after the adapter, which persist when it is replugged
    processes: one folder per process
    """

    latency: Path = Path("/sys/bus/usb-serial/devices")
    by_id: Path = Path("/dev/serial/by-id")
    processes: Path = Path("/proc")


HOST = Host()


class SerialPort(NamedTuple):
    """A serial port.

    device: path to open; by_id: its persistent name, None if it has none
    usb: USB vendor and product id, "0403:6014"; "" for a port that is not on USB
    """

    device: str
    description: str
    usb: str
    by_id: str | None


class Access(NamedTuple):
    """Permissions of this user for a path.

    exists: whether the path exists; is_device: whether it is a device, not a plain file
    allowed: whether it may be read and written
    group: group with access; is_member: whether this user is in it (but perhaps not this session)
    """

    exists: bool
    is_device: bool
    allowed: bool
    group: str
    is_member: bool


def serial_ports(host: Host = HOST) -> tuple[SerialPort, ...]:
    """Return the serial ports, those on USB first."""
    ports = [
        SerialPort(
            port.device,
            port.description,
            f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None else "",
            persistent_name(port.device, host.by_id),
        )
        for port in list_ports.comports()
    ]
    return tuple(sorted(ports, key=lambda port: (not port.usb, port.device)))


def persistent_name(device: str, by_id: Path = HOST.by_id) -> str | None:
    """Return the name of a port that persists when it is replugged; None without one."""
    real, links = os.path.realpath(device), sorted(by_id.glob("*"))
    return next((str(link) for link in links if os.path.realpath(link) == real), None)


def access(device: str) -> Access:
    """Return this user's permissions for a path."""
    try:
        found = os.stat(device)
    except OSError:
        return Access(False, False, False, "", False)
    allowed = os.access(device, os.R_OK | os.W_OK)
    group, members = str(found.st_gid), []
    with contextlib.suppress(KeyError):
        entry = grp.getgrgid(found.st_gid)
        group, members = entry.gr_name, entry.gr_mem
    joined = found.st_gid in os.getgroups() or os.environ.get("USER", "") in members
    return Access(True, stat.S_ISCHR(found.st_mode), allowed, group, joined)


def port_users(device: str, host: Host = HOST) -> tuple[str, ...]:
    """Return the other programs that have a port open, "python3 (process 1234)".

    Only programs that this user may inspect are found.
    """
    real, found = os.path.realpath(device), dict[str, str]()
    if real.startswith("/dev/pts/"):  # the program that serves a pseudo-terminal also has it open
        return ()
    for file in sorted(host.processes.glob("[0-9]*/fd/*")):
        process = file.parent.parent
        with contextlib.suppress(OSError):  # it has ended meanwhile
            if process.name != str(os.getpid()) and os.readlink(file) == real:
                program = (process / "comm").read_text(encoding="utf-8").strip()
                found[process.name] = f"{program} (process {process.name})"
    return tuple(found.values())


# --- latency timer of FTDI adaptors


def latency_file(device: str, host: Host = HOST) -> Path | None:
    """Return the file of the adaptor's latency timer, None if it has none."""
    name = Path(os.path.realpath(device)).name
    file = host.latency / name / "latency_timer"
    return file if file.is_file() else None


def latency_ms(file: Path) -> int | None:
    """Return a latency timer, ms; None if it cannot be read."""
    try:
        return int(file.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def open_failure_text(port_name: str, code: int | None) -> str:
    """Return in one line why a port or an I2C bus cannot be opened, with the remedy."""
    kind, remedy, group, use = "serial port", "plug the adapter in", "dialout", "uses it"
    here = ", ".join(f"{one.device} ({one.description})" for one in list_ports.comports())
    if is_i2c(port_name):
        kind, remedy, group, use = "I2C bus", ABSENT_I2C_REMEDY, "i2c", "moves servos on it"
        here = i2c_names_text()
    others = f"{'buses' if group == 'i2c' else 'ports'} here: {here or 'none'}"
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"no {kind} {port_name}: {remedy}; {others}"
    if code in (errno.EACCES, errno.EPERM):
        found = access(port_name)
        return (
            f"no permission to open {port_name}: join its group with "
            f"'sudo usermod -aG {found.group if found.is_device else group} $USER' and log in again"
        )
    if code in (errno.EBUSY, errno.EAGAIN):
        held = ", ".join(port_users(port_name))
        who = f", {held}," if held else ""
        return f"{port_name} is busy: close the other program{who} that {use}"
    reason = os.strerror(code) if code else "not a device"
    return f"cannot open {port_name} as {kind} ({reason}); {others}"


ABSENT_I2C_REMEDY = "switch I2C on (on a Raspberry Pi: sudo raspi-config, Interface Options), or plug the adapter in"


def i2c_names_text() -> str:
    """Return the names of the kernel's I2C buses as text."""
    return ", ".join(sorted(map(str, Path("/dev").glob("i2c-*")))) or "none"


POLOLU = "1ffb:"
"""USB vendor of Pololu."""


def is_i2c(device: str) -> bool:
    """Return whether the name of a path is that of an I2C bus."""
    return re.fullmatch(r"i2c-\d+", os.path.basename(os.path.realpath(device))) is not None


def usb_id_of(device: str, ports: Sequence[SerialPort]) -> str:
    """Return the USB vendor and product id of a port, "" if it has none or is not listed."""
    real = os.path.realpath(device)
    return next((port.usb for port in ports if os.path.realpath(port.device) == real), "")


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

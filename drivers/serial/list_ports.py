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
from collections.abc import Iterable, Sequence
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


def serial_ports(host: Host | None = None) -> tuple[SerialPort, ...]:
    """Return the serial ports, those on USB first."""
    names = _persistent_names((host or Host()).by_id)
    ports = [
        SerialPort(
            port.device,
            port.description,
            f"{port.vid:04x}:{port.pid:04x}" if port.vid is not None else "",
            names.get(os.path.realpath(port.device)),
        )
        for port in list_ports.comports()
    ]
    return tuple(sorted(ports, key=lambda port: (not port.usb, port.device)))


def _persistent_names(by_id: Path) -> dict[str, str]:
    """Return the persistent name of every device that has one."""
    if not by_id.is_dir():
        return {}
    return {os.path.realpath(link): str(link) for link in sorted(by_id.iterdir())}


def persistent_name(device: str, by_id: Path | None = None) -> str | None:
    """Return the name of a port that persists when it is replugged; None without one."""
    return _persistent_names(by_id or Host().by_id).get(os.path.realpath(device))


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


def port_users(device: str, host: Host | None = None) -> tuple[str, ...]:
    """Return the other programs that have a port open, "python3 (process 1234)".

    Only programs that this user may inspect are found.
    """
    real, own = os.path.realpath(device), str(os.getpid())
    if real.startswith("/dev/pts/"):  # the program that serves a pseudo-terminal also has it open
        return ()
    found = []
    for process in sorted((host or Host()).processes.glob("[0-9]*")):
        if process.name != own and real in _open_files(process):
            program = "a program"
            with contextlib.suppress(OSError, ValueError):
                program = (process / "comm").read_text(encoding="utf-8").strip()
            found.append(f"{program} (process {process.name})")
    return tuple(found)


def _open_files(process: Path) -> Iterable[str]:
    """Return the files that a process has open; none if it may not be inspected."""
    files = []
    with contextlib.suppress(OSError):
        for link in (process / "fd").iterdir():
            with contextlib.suppress(OSError):
                files.append(os.readlink(link))
    return files


# --- latency timer of FTDI adaptors


def latency_file(device: str, host: Host | None = None) -> Path | None:
    """Return the file of the adaptor's latency timer, None if it has none."""
    name = Path(os.path.realpath(device)).name
    file = (host or Host()).latency / name / "latency_timer"
    return file if file.is_file() else None


def latency_ms(file: Path) -> int | None:
    """Return a latency timer, ms; None if it cannot be read."""
    try:
        return int(file.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def set_latency(file: Path, ms: int = RECOMMENDED_LATENCY_MS) -> bool:
    """Write a latency timer; return whether the adaptor has it. Needs write permission."""
    try:
        file.write_text(f"{ms}\n", encoding="ascii")
    except OSError:
        return False
    return latency_ms(file) == ms


def open_failure_text(port_name: str, code: int | None) -> str:
    """Return in one line why a port or an I2C bus cannot be opened, with the remedy."""
    i2c = is_i2c(port_name)
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        if i2c:
            return f"no I2C bus {port_name}: {ABSENT_I2C_REMEDY}; buses here: {i2c_names_text()}"
        return f"no serial port {port_name}: plug the adapter in; ports here: {port_names_text()}"
    if code in (errno.EACCES, errno.EPERM):
        found = access(port_name)
        group = found.group if found.is_device else "i2c" if i2c else "dialout"
        return (
            f"no permission to open {port_name}: join its group with "
            f"'sudo usermod -aG {group} $USER' and log in again"
        )
    if code in (errno.EBUSY, errno.EAGAIN):
        held = ", ".join(port_users(port_name))
        who = f", {held}," if held else ""
        what = "moves servos on it" if i2c else "uses it"
        return f"{port_name} is busy: close the other program{who} that {what}"
    if i2c:
        reason = os.strerror(code) if code else "unknown"
        return f"{port_name} is not an I2C bus ({reason}); buses here: {i2c_names_text()}"
    reason = os.strerror(code) if code else "not a serial port"
    return f"cannot open {port_name} ({reason}); ports here: {port_names_text()}"


ABSENT_I2C_REMEDY = "switch I2C on (on a Raspberry Pi: sudo raspi-config, Interface Options), or plug the adapter in"


def port_names_text() -> str:
    """Return the names of the serial ports as text."""
    ports = [f"{port.device} ({port.description})" for port in list_ports.comports()]
    return ", ".join(ports) or "none"


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

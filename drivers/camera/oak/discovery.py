"""Discovery of OAK cameras, and of the reason why none can be used, before any is opened.

Opening an absent device makes depthai search for more than ten seconds; listing the devices takes
half a second.
"""

import os
from pathlib import Path
from typing import Any

from gazerig.drivers.errors import CameraError, extra_hint

UDEV_RULE = 'SUBSYSTEM=="usb", ATTRS{idVendor}=="03e7", MODE="0666"'
"""Rule that gives all users access to the camera (Luxonis documentation, troubleshooting)."""
_VENDOR = "03e7"  # Movidius, the chip in every OAK with USB
_RIGHTS = (
    "an OAK camera is plugged in but may not be opened: put this line into "
    f"/etc/udev/rules.d/80-movidius.rules: {UDEV_RULE} - then run "
    "sudo udevadm control --reload-rules && sudo udevadm trigger, and plug the camera in again"
)


def find_oak(dai: Any, wanted: str = "", usb: Path = Path("/sys/bus/usb/devices")) -> Any:
    """Return the DeviceInfo of the wanted camera, or of the first one.

    wanted: device id or name (USB port, IP address); usb: the system's folder of USB devices

    Raises:
        CameraError: no camera is found, or it cannot be used; the message contains the reason.
    """
    free = list(dai.Device.getAllAvailableDevices())
    for info in free:
        if not wanted or wanted in (info.deviceId, info.name):
            _check_rights(dai, info)
            return info
    everything = list(
        dai.XLinkConnection.getAllConnectedDevices(
            dai.XLinkDeviceState.X_LINK_ANY_STATE, skipInvalidDevices=False
        )
    )
    for info in everything:
        if not wanted or wanted in (info.deviceId, info.name):
            _check_rights(dai, info)
            raise CameraError(
                f"the OAK camera {_configuration_name(info)} is in use: close the program that uses it"
            )
    if wanted:
        there = ", ".join(_configuration_name(info) for info in [*free, *everything]) or "none"
        raise CameraError(f"no OAK camera {wanted!r} (found: {there}): plug it in, or name another")
    if _is_plugged_in(usb):
        # Some versions of the USB library do not list cameras without permission.
        raise CameraError(_RIGHTS)
    raise CameraError(
        "no OAK camera found: plug it in with a USB 3 cable, give it its power supply, "
        "and check whether lsusb lists 03e7"
    )


def _check_rights(dai: Any, info: Any) -> None:
    """Reject a camera without permission."""
    if info.status == dai.XLinkError_t.X_LINK_INSUFFICIENT_PERMISSIONS:
        raise CameraError(_RIGHTS)


def _configuration_name(info: Any) -> str:
    """Return a camera's name as it can be written into the configuration."""
    return str(info.deviceId or info.name or "without id")


def _is_plugged_in(usb: Path) -> bool:
    """Return whether the system lists an OAK on USB."""
    for file in usb.glob("*/idVendor"):
        try:
            if file.read_text(encoding="ascii", errors="replace").strip() == _VENDOR:
                return True
        except OSError:  # unplugged at this moment
            continue
    return False


START_CURE = (
    "if another program uses it, close that program; if access is denied, set up Luxonis' udev "
    "rule; unplug it, wait a second, plug it in with a USB 3 cable directly at the computer, not a "
    "hub, and connect its power supply; if its sensor refuses the rate, set oak.rate_hz to 30"
)
"""Remedies for an error at the start."""


def load_depthai() -> Any:
    """Import depthai and return the module.

    depthai sends usage figures unless DEPTHAI_TELEMETRY is 0, and logs to the standard output,
    which must contain only the requested output. It reads both settings at its import; the
    environment variable DEPTHAI_LEVEL enables its log.

    Raises:
        CameraError: it is not installed or does not start here.
    """
    os.environ["DEPTHAI_TELEMETRY"] = "0"
    os.environ.setdefault("DEPTHAI_LEVEL", "off")
    try:
        import depthai
    except ImportError as error:
        raise CameraError(extra_hint("depthai", "oak", error)) from error
    return depthai

"""Which OAK camera is there, and why none can be used: looked up before anything is opened.

Opening an absent device makes depthai search for more than ten seconds; asking what there
is takes half a second.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gazerig.drivers.errors import CameraError

UDEV_RULE = 'SUBSYSTEM=="usb", ATTRS{idVendor}=="03e7", MODE="0666"'
"""What lets all users use the camera (Luxonis documentation, troubleshooting)."""
_VENDOR = "03e7"  # Movidius, the chip in every OAK with USB
_RIGHTS = (
    "an OAK camera is plugged in but may not be opened: put this line into "
    f"/etc/udev/rules.d/80-movidius.rules: {UDEV_RULE} - then run "
    "sudo udevadm control --reload-rules && sudo udevadm trigger, and plug the camera in again"
)


def find_oak(dai: Any, wanted: str = "", usb: Path = Path("/sys/bus/usb/devices")) -> Any:
    """Return the DeviceInfo of the camera wanted, or of the first one.

    wanted: device id or name (USB port, IP address); usb: where the system lists USB devices

    Raises:
        CameraError: there is none, or it cannot be used; the message says why.
    """
    free = list(dai.Device.getAllAvailableDevices())
    for info in free:
        if not wanted or wanted in (info.deviceId, info.name):
            _check_rights(dai, info)
            return info
    everything = _all_connected(dai)
    for info in everything:
        if not wanted or wanted in (info.deviceId, info.name):
            _check_rights(dai, info)
            raise CameraError(
                f"the OAK camera {_name(info)} is in use: end the other program that has it"
            )
    if wanted:
        there = ", ".join(_name(info) for info in [*free, *everything]) or "none"
        raise CameraError(
            f"no OAK camera {wanted!r} (there is: {there}): plug it in, or name another"
        )
    if _plugged_in(usb):
        # Cameras without rights are not listed at all by some versions of the USB library.
        raise CameraError(_RIGHTS)
    raise CameraError(
        "no OAK camera found: plug it in with a USB 3 cable, give it its power supply, "
        "and look whether lsusb shows 03e7"
    )


def _check_rights(dai: Any, info: Any) -> None:
    """Refuse a camera that may not be opened."""
    if info.status == dai.XLinkError_t.X_LINK_INSUFFICIENT_PERMISSIONS:
        raise CameraError(_RIGHTS)


def _all_connected(dai: Any) -> Sequence[Any]:
    """Return all cameras, with those in use and those without rights."""
    return list(
        dai.XLinkConnection.getAllConnectedDevices(
            dai.XLinkDeviceState.X_LINK_ANY_STATE, skipInvalidDevices=False
        )
    )


def _name(info: Any) -> str:
    """Call a camera by what a person can write into the configuration."""
    return str(info.deviceId or info.name or "without id")


def _plugged_in(usb: Path) -> bool:
    """Return whether the system sees an OAK at USB."""
    for file in usb.glob("*/idVendor"):
        try:
            if file.read_text(encoding="ascii", errors="replace").strip() == _VENDOR:
                return True
        except OSError:  # unplugged in this moment
            continue
    return False

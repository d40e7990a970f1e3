"""Exposure, gain, mains frequency and focus of a webcam, set with Video4Linux controls.

OpenCV supports only some of them and does not report why one was refused, so they are set on the
device file. A camera keeps its settings after the program ends, so automatic modes are set as well.
"""

import errno
import os
import struct
from collections.abc import Iterator
from pathlib import Path

from gazerig.drivers.camera.params import WebcamParams

# From linux/v4l2-controls.h and videodev2.h.
AUTO_GAIN, GAIN = 0x00980912, 0x00980913
MAINS = 0x00980918
AUTO_EXPOSURE, EXPOSURE = 0x009A0901, 0x009A0902
FOCUS, AUTO_FOCUS = 0x009A090A, 0x009A090C
SET_CONTROL = 0xC008561C
"""Request VIDIOC_S_CTRL; its argument is the number of a control and a value."""

_EXPOSURE_MANUAL, _EXPOSURE_AUTO, _EXPOSURE_BY_APERTURE = 1, 0, 3
_EXPOSURE_UNIT_MS = 0.1
_MAINS = {"off": 0, "50hz": 1, "60hz": 2, "auto": 3}


def apply(device: Path, params: WebcamParams) -> Iterator[str]:
    """Set the controls; yield one line for each setting that the camera rejects.

    Settings without a value become automatic; a camera without automatic modes is not reported.
    """
    try:
        file = os.open(device, os.O_RDWR | os.O_NONBLOCK)
    except OSError:
        return  # the camera itself is rejected with another message
    try:
        if params.exposure_ms is None:
            if _set_control(file, AUTO_EXPOSURE, _EXPOSURE_BY_APERTURE):
                _set_control(file, AUTO_EXPOSURE, _EXPOSURE_AUTO)
        else:
            _set_control(file, AUTO_EXPOSURE, _EXPOSURE_MANUAL)
            units = max(1, round(params.exposure_ms / _EXPOSURE_UNIT_MS))
            yield from _report(
                "exposure_ms", params.exposure_ms, _set_control(file, EXPOSURE, units)
            )
        if params.gain is None:
            _set_control(file, AUTO_GAIN, 1)
        else:
            _set_control(file, AUTO_GAIN, 0)
            yield from _report("gain", params.gain, _set_control(file, GAIN, params.gain))
        if params.anti_flicker != "default":
            why = _set_control(file, MAINS, _MAINS[params.anti_flicker])
            yield from _report("anti_flicker", params.anti_flicker, why)
        if params.focus is None:
            _set_control(file, AUTO_FOCUS, 1)
        else:
            _set_control(file, AUTO_FOCUS, 0)
            yield from _report("focus", params.focus, _set_control(file, FOCUS, params.focus))
    finally:
        os.close(file)


def _report(name: str, value: object, why: str) -> Iterator[str]:
    if why:
        yield f"does not accept webcam.{name}: {value} ({why}): omit it or give another value"


def _set_control(file: int, control: int, value: int) -> str:
    """Set a control; return why it failed, "" on success."""
    try:
        import fcntl  # absent on Windows
    except ImportError:
        return "this system has no Video4Linux"
    try:
        fcntl.ioctl(file, SET_CONTROL, struct.pack("=Ii", control, value))
    except OSError as error:
        if error.errno in (errno.EINVAL, errno.ENOTTY):
            return "it has no such control"
        return "out of its range" if error.errno == errno.ERANGE else str(error.strerror)
    return ""

"""Sources of frames in real time: a camera, a film paced by the clock, or a recording."""

import threading
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import Depth, ImageArray


class Shot(NamedTuple):
    """A frame and its time.

    captured_s: host time of the exposure (for a film: time at which the frame was due)
    number: number of the frame from 1; skipped frames count too

    The following fields are None if the source does not provide them:

    depth_m: distances, aligned with the frame and of its size, NaN where unknown
    lens: the lens of this frame
    """

    captured_s: float
    number: int
    image: ImageArray
    depth_m: Depth | None = None
    lens: Intrinsics | None = None


class FrameSource(Protocol):
    """A source of frames; each ``take`` returns the newest one."""

    def open(self) -> None:
        """Open the device or file.

        Raises:
            CameraError: it cannot be opened; the message names it and the remedy.
        """

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for a frame newer than the last one; return None if ``stop`` was set meanwhile.

        Raises:
            CameraError: there will be no more frames.
        """

    def events(self) -> tuple[str, ...]:
        """Return events for the user since the last call, one line each."""

    def close(self) -> None:
        """Free the device or file; safe to call twice."""


_OLDEST_STAMP_S = 1.0


def exposure_s(stamp_s: float, arrived_s: float, latency_s: float = 0.0) -> float:
    """Return the time of a frame: its stamp, or its arrival minus the latency.

    A stamp that is in the future or too old is not of the host's clock.
    """
    is_plausible = 0.0 <= arrived_s - stamp_s <= _OLDEST_STAMP_S
    return stamp_s if is_plausible else arrived_s - latency_s


def to_bgr(pixels: Any) -> ImageArray | None:
    """Return pixels of a camera or file as a read-only BGR frame; None if they are not an image.

    pixels: (h, w) or (h, w, 1) grey, (h, w, 3) BGR or (h, w, 4) BGR with alpha, 8 bits, or 16 bits,
        of which the upper 8 are kept
    """
    found = np.asarray(pixels)
    if found.dtype == np.uint16:
        found = (found >> 8).astype(np.uint8)
    channels = 1 if found.ndim == 2 else found.shape[2] if found.ndim == 3 else 0
    if found.dtype != np.uint8 or not found.size or channels not in (1, 3, 4):
        return None
    if channels != 3:
        import cv2  # only in the process with the camera, not in that of the control loop
    if channels == 1:
        found = np.asarray(cv2.cvtColor(found, cv2.COLOR_GRAY2BGR), np.uint8)
    elif channels == 4:
        found = np.asarray(cv2.cvtColor(found, cv2.COLOR_BGRA2BGR), np.uint8)
    found.setflags(write=False)
    return found

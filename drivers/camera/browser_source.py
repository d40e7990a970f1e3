"""Frames of a browser's camera, which its page sends as JPEGs, a few per second."""

import threading
from collections.abc import Callable
from math import radians

import numpy as np

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.camera.shared_slots import JpegSlot
from gazerig.drivers.camera.source import Shot, to_bgr

FIELD_DEG = 60.0
"""Assumed horizontal field of view of an unknown camera."""
LATENCY_S = 0.08
"""Delay from the exposure to the arrival: camera, browser, encoding, network."""
_LOOK_S = 0.004
_LARGEST_PX = 1920


class BrowserSource:
    """Source of the pictures in a slot."""

    def __init__(self, pictures: JpegSlot) -> None:
        self._pictures = pictures
        self._number = 0
        self._reported = False
        self._events: list[str] = []

    def open(self) -> None:
        """Begin with the next picture."""

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for the next picture; skip unreadable ones."""
        while not stop.is_set():
            picture = self._pictures.newer(self._number)
            if picture is None:
                stop.wait(_LOOK_S)
                continue
            self._number = picture.number
            import cv2  # only in the camera's process, not in that of the control loop

            image = to_bgr(cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_COLOR))
            if image is None or max(image.shape) > _LARGEST_PX:
                if not self._reported:
                    self._reported = True
                    self._events.append(
                        "a browser sends pictures that cannot be read: they are skipped"
                    )
                continue
            height, width = image.shape[:2]
            lens = intrinsics_of_view(radians(FIELD_DEG), width, height)
            return Shot(picture.came_s - LATENCY_S, picture.number, image, lens=lens)
        return None

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events, self._events = tuple(self._events), []
        return events

    def close(self) -> None:
        """Stop; there is nothing to free."""

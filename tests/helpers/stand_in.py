"""Substitutes for a port or a camera have only the parts that the test needs."""

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:

    class StandIn(Any):
        """Passes for every type."""
else:

    class StandIn:
        """Nothing of its own."""


class Capture(StandIn):
    """The part of cv2.VideoCapture the driver uses; ``failures`` grabs fail after the first."""

    def __init__(self, stamp_ms: float = 0.0, works: bool = True) -> None:
        self.stamp_ms = stamp_ms
        self.works = works
        self.stated_hz = 0.0
        self.picture = None
        self.failures = 0
        self.empty = 0
        self.grabs = 0
        self.released = False
        self.wishes: dict[int, float] = {}

    def isOpened(self) -> bool:  # noqa: N802
        return True

    def grab(self) -> bool:
        self.grabs += 1
        if self.grabs > 1 and self.failures > 0:
            self.failures -= 1
            return False
        return self.works

    def retrieve(self):
        if self.empty > 0:
            self.empty -= 1
            return True, np.zeros((0, 0, 3), np.uint8)
        if self.picture is not None:
            return True, self.picture
        return True, np.full((4, 6, 3), self.grabs, np.uint8)

    def get(self, what: int) -> float:
        return {
            cv2.CAP_PROP_POS_MSEC: self.stamp_ms,
            cv2.CAP_PROP_FPS: self.stated_hz,
        }[what]

    def set(self, what: int, value: float) -> bool:
        self.wishes[what] = value
        return True

    def release(self) -> None:
        self.released = True

"""Tracking of eyes: the network for irises and lids runs only on eyes that have changed.

The network takes longer than that for the whole face, and eyes rest most of the time. If the crop
of an eye is unchanged since the network last ran, the iris and lids are the same.
"""

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import ImageArray

Floats = NDArray[np.float64]
EyePoints = tuple[Floats, Floats]
"""Five points of an iris and the contour of its lids, in pixels of the crop."""

# Part of a crop that contains the eye, and size of the average against noise.
_EYE, _AVERAGED_PX = np.s_[16:48, 12:52], (5, 5)
# Smallest change of an eye, as a share of its contrast and in grey levels: 5 deg of gaze at .4 to
# 1.2 m change it by .35, a blink by more than .9, noise of sensor and mesh by .1 to .25.
_CHANGED, _LEAST_GREY = 0.3, 4.0
# Number of frames after which even an unchanged eye is analysed again.
_LONGEST_FRAMES = 8
# Network runs allowed per frame, and the most that can be saved: eyes that never rest, or a turning
# face, are analysed in every fourth frame, a blink in its own frames.
_LOOKS_A_FRAME, _MOST_LOOKS = 0.25, 2.0


class _EyeReading(NamedTuple):
    """Last run of the network: (2, ...) eyes, centres of their crops, and resulting points."""

    eyes: NDArray[np.float32]
    points: tuple[EyePoints | None, ...]


class EyeLandmarkCache:
    """Tracker of both eyes of one face, or of its successor: appearance decides, not identity."""

    def __init__(self) -> None:
        self._last: _EyeReading | None = None
        self._frames = 0
        self._allowed = _MOST_LOOKS

    def read(
        self, crops: list[ImageArray], look: Callable[[ImageArray, int], EyePoints | None]
    ) -> tuple[EyePoints | None, ...] | None:
        """Return the points of both eyes, None if they have changed and are not analysed.

        Args:
            crops: Crops (64, 64, 3) of the right and of the left eye.
            look: Runs the network on a crop; the right eye is 0.
        """
        self._allowed = min(self._allowed + _LOOKS_A_FRAME, _MOST_LOOKS)
        self._frames += 1
        eyes = np.array(
            [cv2.cvtColor(crop, cv2.COLOR_BGR2GRAY)[_EYE] for crop in crops], np.float32
        )
        last = self._last
        changed = last is None or any(map(_differs, last.eyes, eyes))
        if last is not None and not changed and self._frames < _LONGEST_FRAMES:
            return last.points
        if self._allowed < 1.0:
            return None if last is None or changed else last.points
        self._allowed -= 1.0
        self._frames = 0
        self._last = _EyeReading(
            eyes, tuple([look(crop, which) for which, crop in enumerate(crops)])
        )
        return self._last.points


def _differs(before: NDArray[np.float32], now: NDArray[np.float32]) -> bool:
    """Return whether the appearance of an eye has changed."""
    change = cv2.blur(now - before, _AVERAGED_PX)
    return float(np.abs(change).max()) > max(_LEAST_GREY, _CHANGED * float(before.std()))

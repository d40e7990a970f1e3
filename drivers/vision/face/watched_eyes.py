"""Eyes from frame to frame: the network that places irises and lids looks where they have changed.

It costs more than that of the whole face, and eyes rest most of the time. A crop of an eye that
looks as it did when the network saw it last shows the same iris between the same lids.
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

# The part of a crop that holds the eye, and over what noise is averaged in it.
_EYE, _AVERAGED_PX = np.s_[16:48, 12:52], (5, 5)
# A change anywhere in it of more than this share of its contrast, and of so many grey levels, is
# one of the eye: 5 deg of gaze at .4 to 1.2 m change it by .35, a blink by more than .9; noise of
# the sensor and of the mesh by .1 to .25.
_CHANGED, _LEAST_GREY = 0.3, 4.0
# Even what does not seem to change is looked at again after so many frames.
_LONGEST_FRAMES = 8
# Looks that each frame allows, and how many can be saved: eyes that never rest, or a face that
# turns, are looked at in every fourth frame, a blink in the frames in which it comes.
_LOOKS_A_FRAME, _MOST_LOOKS = 0.25, 2.0


class _Look(NamedTuple):
    """What the network saw: (2, ...) eyes, the middles of their crops, and what it made of them."""

    eyes: NDArray[np.float32]
    points: tuple[EyePoints | None, ...]


class WatchedEyes:
    """Both eyes of one face, or of whoever has taken its place: looks decide, not identity."""

    def __init__(self) -> None:
        self._last: _Look | None = None
        self._frames = 0
        self._allowed = _MOST_LOOKS

    def read(
        self, crops: list[ImageArray], look: Callable[[ImageArray, int], EyePoints | None]
    ) -> tuple[EyePoints | None, ...] | None:
        """Return the points of both eyes, None where they have changed and are not looked at.

        Args:
            crops: (64, 64, 3) of the right and of the left eye.
            look: runs the network on a crop; the right eye is 0.
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
        self._last = _Look(eyes, tuple([look(crop, which) for which, crop in enumerate(crops)]))
        return self._last.points


def _differs(before: NDArray[np.float32], now: NDArray[np.float32]) -> bool:
    """Return whether an eye looks otherwise than it did."""
    change = cv2.blur(now - before, _AVERAGED_PX)
    return float(np.abs(change).max()) > max(_LEAST_GREY, _CHANGED * float(before.std()))

"""Cuts: a frame that shows another scene than the one before it.

Films have them, and so has a camera that is plugged in elsewhere. People who are seen after a cut
are not those of before it, wherever in the image they are. Judged is what a very small grey image
looks like beside the one before: as a whole, and its middle wherever it may have moved to, because
a camera that pans shows the same scene. Brighter or darker light changes neither.
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 48, 32
"""Size of the small image."""
# Pixels of the frame of which the small ones are means; more of them tell nothing more.
_SAMPLED_PX = 192
# Correlations below which two images show two scenes. From one frame of a film to the next they are
# above .9 as a whole, of pans above .9 in the middle; across cuts below .3 and .72.
_WHOLE, _MIDDLE = 0.4, 0.8
# What has less contrast, grey levels, shows nothing: dark, covered, blinded.
_LEAST_CONTRAST = 6.0
_MARGIN = 4  # the middle is all but a fourth of the image on each side


class CutDetector:
    """Counts the scenes of a camera's images."""

    def __init__(self) -> None:
        self._before: NDArray[np.float32] | None = None
        self._scene = 0

    def scene(self, image: NDArray[Any]) -> int:
        """Return the number of the scene that an image shows, from 0; it rises with each cut.

        Args:
            image: (h, w) or (h, w, channels) uint8, of any size.
        """
        now = _small(image)
        if now.std() < _LEAST_CONTRAST:
            return self._scene  # what follows is compared with the last that showed something
        before, self._before = self._before, now
        if before is not None and _is_cut(before, now):
            self._scene += 1
        return self._scene


def _small(image: NDArray[Any]) -> NDArray[np.float32]:
    step = max(1, min(image.shape[0], image.shape[1]) // _SAMPLED_PX)
    green = image[::step, ::step, 1] if image.ndim == 3 else image[::step, ::step]
    size = (WIDTH, HEIGHT)
    small = cv2.resize(np.ascontiguousarray(green), size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def _is_cut(before: NDArray[np.float32], now: NDArray[np.float32]) -> bool:
    """Return whether two small images show different scenes."""
    if _correlation(before, now) >= _WHOLE:
        return False
    top, left = HEIGHT // _MARGIN, WIDTH // _MARGIN
    return all(
        _correlation(one, other[top:-top, left:-left]) < _MIDDLE
        for one, other in ((before, now), (now, before))
    )


def _correlation(image: NDArray[np.float32], part: NDArray[np.float32]) -> float:
    """Return the highest correlation of a part with any place of an image."""
    return float(cv2.matchTemplate(image, part, cv2.TM_CCOEFF_NORMED).max())

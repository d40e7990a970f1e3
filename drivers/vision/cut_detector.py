"""Detection of cuts: a frame that shows another scene than the previous one.

Cuts occur in films, and if a camera is plugged in elsewhere. People after a cut are not those
before it, even at the same position. A very small grey image is compared with the previous one: as
a whole, and its centre at any displacement, because a camera that pans shows the same scene.
Brighter or darker light changes neither.
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 48, 32
"""Size of the small image."""
# Width in pixels to which the frame is sampled before averaging; more adds no information.
_SAMPLED_PX = 192
# Correlations below which two images show two scenes. Between consecutive frames of a film they are
# above .9 as a whole, in pans above .9 in the middle; across cuts below .3 and .72.
_WHOLE, _MIDDLE = 0.4, 0.8
# Contrast in grey levels below which an image has no content: dark, covered or overexposed.
_LEAST_CONTRAST = 6.0
_MARGIN = 4  # the middle is all but a fourth of the image on each side


class CutDetector:
    """Counter of the scenes in a camera's images."""

    def __init__(self) -> None:
        self._before: NDArray[np.float32] | None = None
        self._scene = 0

    def scene(self, image: NDArray[Any]) -> int:
        """Return the number of an image's scene, from 0; it increases with each cut.

        Args:
            image: Image (h, w, 3), uint8, of any size.
        """
        step = max(1, min(image.shape[0], image.shape[1]) // _SAMPLED_PX)
        green = np.ascontiguousarray(image[::step, ::step, 1])
        small = cv2.resize(green, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
        now = np.asarray(small, np.float32)
        if now.std() < _LEAST_CONTRAST:
            return self._scene  # later images are compared with the last one with content
        before, self._before = self._before, now
        if before is not None and _correlation(before, now) < _WHOLE:
            top, left = HEIGHT // _MARGIN, WIDTH // _MARGIN
            self._scene += all(
                _correlation(one, other[top:-top, left:-left]) < _MIDDLE
                for one, other in ((before, now), (now, before))
            )
        return self._scene


def _correlation(image: NDArray[np.float32], part: NDArray[np.float32]) -> float:
    return float(cv2.matchTemplate(image, part, cv2.TM_CCOEFF_NORMED).max())

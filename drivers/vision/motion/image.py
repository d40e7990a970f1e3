"""The small grey image that is searched for motion, and its lens.

Pixels have their centres at whole numbers: an image of width w extends from -0.5 to w - 0.5, so
scaling by s takes u to s (u + 0.5) - 0.5.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics

Grey = NDArray[np.uint8]
"""(height, width)."""
Floats = NDArray[np.float64]
Plane = NDArray[np.float32]
"""(height, width)."""


# Width above which changes are light, not things, and the limit of such changes in grey levels.
_LIGHT_PX, _LIGHT_STEP = 21, 8.0
LEAST_SIDE_PX = 48
"""Shortest side of an image that is searched for flow."""


class SmallImage(NamedTuple):
    """A scaled grey image.

    scale: (x, y) small pixels per pixel of the original image
    K: (3, 3) camera matrix of the small image
    fine_grey: the image before it was halved for the search; ``grey`` itself if it was not
    """

    grey: Grey
    scale: tuple[float, float]
    K: Floats
    captured_s: float
    fine_grey: Grey


def scale_down(
    image: NDArray[Any], work_px: int, lens: Intrinsics, captured_s: float
) -> SmallImage:
    """Scale an image so that its longer side is at most ``work_px``, and convert it to grey.

    It is scaled before it is converted, which is less work on a large image. For the search it is
    halved, unless it becomes too small: a finer flow shows smaller things and takes three to four
    times as long.

    Raises:
        ValueError: it is not an 8-bit image: grey, BGR or BGR with alpha.
    """
    channels = image.shape[2] if image.ndim == 3 else 1
    right = image.ndim in (2, 3) and channels in (1, 3, 4) and image.size > 0
    if not right or image.dtype != np.uint8:
        raise ValueError(
            "an image is (height, width), or that with 1, 3 or 4 channels, of uint8, not "
            f"{image.shape} of {image.dtype}"
        )
    height, width = image.shape[:2]
    shrink = min(1.0, work_px / max(width, height))
    size = max(1, round(width * shrink)), max(1, round(height * shrink))
    if size != (width, height):
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    fine = to_grey(image)
    grey = fine
    if min(size) // 2 >= LEAST_SIDE_PX:
        size = size[0] // 2, size[1] // 2
        grey = np.asarray(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), np.uint8)
    scale = size[0] / width, size[1] / height
    return SmallImage(grey, scale, lens.scaled(*scale).matrix, captured_s, fine)


def to_grey(image: NDArray[Any]) -> Grey:
    """Return the brightness (h, w) of an image in BGR, BGR with alpha, or grey."""
    channels = image.shape[2] if image.ndim == 3 else 1
    if channels == 3:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if channels == 4:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2GRAY), dtype=np.uint8)
    return np.ascontiguousarray(image.reshape(image.shape[:2]))


def remove_illumination(change: Plane) -> Plane:
    """Return a change of brightness without that of the light, which covers wider areas."""
    # Clipped, as otherwise a dark coat would darken its surroundings.
    light = cv2.blur(np.clip(change, -_LIGHT_STEP, _LIGHT_STEP), (_LIGHT_PX, _LIGHT_PX))
    return np.asarray(change - light, np.float32)


def to_original_px(
    point_px: tuple[float, float], scale: tuple[float, float]
) -> tuple[float, float]:
    """Return the position of a point of the small image in the original image."""
    return (point_px[0] + 0.5) / scale[0] - 0.5, (point_px[1] + 0.5) / scale[1] - 0.5


def upper_median(values: Floats) -> float:
    """Return the upper median of (n,) values, n > 0; five times faster than NumPy's."""
    half = len(values) // 2
    return float(np.partition(values, half)[half])

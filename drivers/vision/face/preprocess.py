"""Images made ready for a face network, and its finds put back into the image given."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import DetectedFace, ImageArray


class Prepared(NamedTuple):
    """A image in the two sizes a detector needs.

    full: (height, width, 3) BGR, the size given
    small: the same, scaled down to the working width
    stretch: (2,) full size over small size, x and y
    """

    full: ImageArray
    small: ImageArray
    stretch: NDArray[np.float64]


def prepare(image: ImageArray, work_width_px: int) -> Prepared | None:
    """Bring a grey, BGR or BGRA image to BGR and scale it down; None where it has no pixels.

    Raises:
        ValueError: the array is not a image of 8-bit numbers.
    """
    full = as_bgr(image)
    height, width = full.shape[:2]
    if height == 0 or width == 0:
        return None
    small = full
    if width > work_width_px:
        size = work_width_px, max(1, round(height * work_width_px / width))
        small = np.asarray(cv2.resize(full, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    stretch = np.array([width / small.shape[1], height / small.shape[0]])
    return Prepared(full, small, stretch)


def largest_first(faces: list[DetectedFace]) -> tuple[DetectedFace, ...]:
    """Sort by box area; equal areas by place, so that the order never depends on chance."""
    return tuple(sorted(faces, key=lambda f: (-f.box_px[2] * f.box_px[3], f.box_px)))


def as_bgr(image: ImageArray) -> ImageArray:
    """Bring any of the usual pixel layouts to contiguous BGR.

    Raises:
        ValueError: the array is not an image of 8-bit numbers.
    """
    shape = image.shape
    if image.dtype != np.uint8 or len(shape) not in (2, 3) or shape[2:] not in _LAYOUTS:
        raise ValueError(
            f"an image is (height, width[, 1, 3 or 4]) of uint8, not {shape} of {image.dtype}"
        )
    code = _LAYOUTS[shape[2:]]
    if code is None or image.size == 0:
        return np.ascontiguousarray(image)
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(image), code), dtype=np.uint8)


_LAYOUTS: dict[tuple[int, ...], int | None] = {
    (): cv2.COLOR_GRAY2BGR,
    (1,): cv2.COLOR_GRAY2BGR,
    (3,): None,
    (4,): cv2.COLOR_BGRA2BGR,
}

"""Square crops of an image, scaled to the size of a network's input."""

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import ImageArray

# Boxes that are shrunk by more than this are cropped at whole pixels and averaged; others are
# cropped between pixels, as half a pixel matters for a face of ten.
_AVERAGED_FROM = 1.5


def crop_square(
    image: ImageArray, box: NDArray[np.float64], side_px: int
) -> tuple[ImageArray, NDArray[np.float64]]:
    """Crop a square box (left, top, right, bottom; pixel edges), black beyond the image.

    Returns:
        The crop (side_px, side_px, 3), and its actual box, which differs from the given one by less
        than a pixel.
    """
    if box[2] - box[0] > _AVERAGED_FROM * side_px:
        box = np.rint(box)
        return _average_crop(image, box, side_px), box
    left, top, right, bottom = box.tolist()
    x, y = side_px / max(right - left, 1e-3), side_px / max(bottom - top, 1e-3)
    # Pixel edges are whole numbers here; in OpenCV pixel centres are.
    M = np.array([[x, 0.0, (0.5 - left) * x - 0.5], [0.0, y, (0.5 - top) * y - 0.5]])
    part = cv2.warpAffine(image, M, (side_px, side_px), flags=cv2.INTER_CUBIC)
    return np.asarray(part, np.uint8), box


def _average_crop(image: ImageArray, box: NDArray[np.float64], side_px: int) -> ImageArray:
    """Crop a box of whole pixels and shrink it."""
    left, top, right, bottom = (int(edge) for edge in box)
    inside = image[max(0, top) : max(0, bottom), max(0, left) : max(0, right)]
    if inside.shape[:2] != (bottom - top, right - left):
        patch = np.zeros((bottom - top, right - left, 3), np.uint8)
        x, y = max(0, -left), max(0, -top)
        patch[y : y + inside.shape[0], x : x + inside.shape[1]] = inside
        inside = patch
    part = cv2.resize(inside, (side_px, side_px), interpolation=cv2.INTER_AREA)
    return np.asarray(part, np.uint8)

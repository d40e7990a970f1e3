"""Preparation of images for a face network."""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import DetectedFace, ImageArray

# Grey levels of an image: share outside its range at each end; contrast below which it is flat,
# wanted contrast, and largest gain.
_OUTSIDE, _FLAT_GREY, _WANTED_GREY, _MOST_GAIN = 0.01, 110.0, 200.0, 8.0
# Gain from which sensor noise would be visible, so that the image is smoothed.
_NOISY_GAIN, _SMOOTHED_PX = 2.5, 0.8
_SAMPLED = 4


class PreparedImage(NamedTuple):
    """An image in the two sizes that a detector needs.

    full_size: (height, width, 3) BGR, in the original size
    working_size: the same image, scaled down to the working width
    full_per_working: (2,) full size over small size, x and y
    """

    full_size: ImageArray
    working_size: ImageArray
    full_per_working: NDArray[np.float64]


def prepare(image: ImageArray, work_width_px: int) -> PreparedImage | None:
    """Convert a grey, BGR or BGRA image to BGR and scale it down; return None if it has no pixels.

    Raises:
        ValueError: the array is not an 8-bit image.
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
    return PreparedImage(full, small, stretch)


def grey_range(samples: NDArray[Any]) -> tuple[float, float]:
    """Return the grey levels below and above which a hundredth of an image is."""
    ordered = np.sort(samples, axis=None)
    count = len(ordered)
    return float(ordered[int(_OUTSIDE * count)]), float(ordered[int((1.0 - _OUTSIDE) * count)])


def improve_contrast(image: ImageArray) -> ImageArray:
    """Return a dark or pale image with the contrast that a network needs, others unchanged.

    A high gain also amplifies noise, so the image is then smoothed.
    """
    dark, bright = grey_range(image[::_SAMPLED, ::_SAMPLED, 1])
    if bright - dark >= _FLAT_GREY:
        return image
    gain = min(_WANTED_GREY / max(bright - dark, 1.0), _MOST_GAIN)
    table = np.clip((np.arange(256) - dark) * gain, 0.0, 255.0).astype(np.uint8)
    out = cv2.LUT(image, table)
    if gain > _NOISY_GAIN:
        out = cv2.GaussianBlur(out, (0, 0), _SMOOTHED_PX)
    return np.asarray(out, np.uint8)


def sort_by_size(faces: list[DetectedFace]) -> tuple[DetectedFace, ...]:
    """Return faces sorted by box area, equal areas by position, so that the order is fixed."""
    return tuple(sorted(faces, key=lambda f: (-f.box_px[2] * f.box_px[3], f.box_px)))


def as_bgr(image: ImageArray) -> ImageArray:
    """Convert any of the usual pixel layouts to contiguous BGR.

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
        left, top, right, bottom = (int(edge) for edge in box)
        inside = image[max(0, top) : max(0, bottom), max(0, left) : max(0, right)]
        if inside.shape[:2] != (bottom - top, right - left):
            patch = np.zeros((bottom - top, right - left, 3), np.uint8)
            x, y = max(0, -left), max(0, -top)
            patch[y : y + inside.shape[0], x : x + inside.shape[1]] = inside
            inside = patch
        part = cv2.resize(inside, (side_px, side_px), interpolation=cv2.INTER_AREA)
        return np.asarray(part, np.uint8), box
    left, top, right, bottom = box.tolist()
    x, y = side_px / max(right - left, 1e-3), side_px / max(bottom - top, 1e-3)
    # Pixel edges are whole numbers here; in OpenCV pixel centres are.
    M = np.array([[x, 0.0, (0.5 - left) * x - 0.5], [0.0, y, (0.5 - top) * y - 0.5]])
    part = cv2.warpAffine(image, M, (side_px, side_px), flags=cv2.INTER_CUBIC)
    return np.asarray(part, np.uint8), box

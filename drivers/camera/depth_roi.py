"""Distance of an object from a depth image with holes, edges and outliers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import Depth

_MM_PER_M = 1000.0
# Nearest distance that a stereo camera with a baseline of a hand's breadth can measure.
_NEAREST_M = 0.05
# A gap in depth of this share of the distance separates an object from its background.
_GAP = 0.15
_LEAST_SHARE = 0.15  # share of the valid pixels; a smaller, nearer layer is clutter
_SIGMAS = 1.4826  # from the median of absolute deviations to a standard deviation
_MOST_PIXELS = 4096


class DepthReading(NamedTuple):
    """Distance of one object in a depth image.

    distance_m: None if unknown
    spread_m: robust standard deviation of its pixels; valid_share: share of valid pixels, 0..1
    """

    distance_m: float | None
    spread_m: float
    valid_share: float


_NOTHING = DepthReading(None, 0.0, 0.0)


def depth_at(
    depth_m: Depth, box_px: tuple[float, float, float, float], shrink: float = 0.6
) -> DepthReading:
    """Return the distance of the object that a box of the frame covers.

    The nearest layer of sufficient size is the object; other layers are behind it.

    box_px: x, y, width, height; only its central share ``shrink`` is read, as its edges contain
        background
    """
    depth = np.asarray(depth_m)
    if depth.ndim != 2 or not np.isfinite(box_px).all():
        return _NOTHING
    height, width = depth.shape
    x, y, w, h = box_px
    middle_x, middle_y = x + w / 2.0, y + h / 2.0
    half_x, half_y = max(0.5, shrink * w / 2.0), max(0.5, shrink * h / 2.0)
    top, bottom = np.clip([round(middle_y - half_y), round(middle_y + half_y)], 0, height)
    left, right = np.clip([round(middle_x - half_x), round(middle_x + half_x)], 0, width)
    seen = np.asarray(depth[top:bottom, left:right], dtype=np.float64).ravel()
    if not seen.size:
        return _NOTHING
    step = -(-seen.size // _MOST_PIXELS)
    seen = seen[::step]
    valid = np.sort(seen[np.isfinite(seen) & (seen >= _NEAREST_M)])
    if not valid.size:
        return _NOTHING
    # The nearest run of distances without a gap.
    layers = np.split(valid, np.flatnonzero(np.diff(valid) > _GAP * valid[:-1]) + 1)
    layer = next((one for one in layers if one.size >= _LEAST_SHARE * valid.size), valid)
    distance_m = float(np.median(layer))
    spread_m = _SIGMAS * float(np.median(np.abs(layer - distance_m)))
    return DepthReading(distance_m, spread_m, layer.size / seen.size)


def to_metres(depth_mm: NDArray[np.uint16]) -> Depth:
    """Convert a camera's millimetres (0: unknown) to read-only metres (NaN: unknown)."""
    depth = depth_mm.astype(np.float32)
    depth[depth_mm == 0] = np.nan
    depth /= np.float32(_MM_PER_M)
    depth.setflags(write=False)
    return depth


def to_millimetres(depth_m: Depth) -> NDArray[np.uint16]:
    """Convert metres to whole millimetres, 0 if unknown or beyond 65 m."""
    with np.errstate(over="ignore"):
        mm = np.rint(np.asarray(depth_m, dtype=np.float32) * np.float32(_MM_PER_M))
    known = (mm > 0.0) & (mm <= np.iinfo(np.uint16).max)
    return np.where(known, mm, np.float32(0.0)).astype(np.uint16)


def resize_depth(depth_m: Depth, width_px: int, height_px: int) -> Depth:
    """Resize a depth image to its colour image, without inventing distances."""
    if depth_m.shape == (height_px, width_px):
        return depth_m
    import cv2  # here, as the control loop's process reads depths but does not resize

    size = width_px, height_px
    found = np.asarray(cv2.resize(depth_m, size, interpolation=cv2.INTER_NEAREST), np.float32)
    found.setflags(write=False)
    return found

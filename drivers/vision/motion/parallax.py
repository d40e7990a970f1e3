"""Parallax: motion of still things in the image when the lens itself moves, by their distance.

A neck turns about an axis some centimetres behind the lens, so near things move relative to far
ones. With the older image turned as predicted, a point that is now at X, in the present axes, was
seen at X - t; the effect depends on its depth.
"""

import numpy as np

from gazerig.drivers.vision.motion.image import Floats, Plane
from gazerig.drivers.vision.motion.optical_flow import Flow

# At shorter distances no lens is sharp, and depth cameras return invalid values.
_NEAREST_M = 0.1
# A lens that moves less than this between two images is at rest.
_STILL_M = 1e-4


def parallax(depth_m: Plane | None, K: Floats, t_now_before_m: Floats | None) -> Flow | None:
    """Return the displacement of still things in the older image, (h, w, 2), pixels.

    depth_m: (h, w), NaN if unknown: the image's median distance is used there
    t_now_before_m: (3,) earlier position of the lens relative to the present one, in present axes

    The result is None if the lens is at rest, or depth or motion are unknown.
    """
    if depth_m is None or t_now_before_m is None or not np.isfinite(t_now_before_m).all():
        return None
    known = np.isfinite(depth_m)
    if np.linalg.norm(t_now_before_m) < _STILL_M or not known.any():
        return None
    middle = np.float32(np.median(depth_m[known]))
    z = np.maximum(np.where(known, depth_m, middle), np.float32(_NEAREST_M))
    tx, ty, tz = (np.float32(v) for v in t_now_before_m)
    height, width = depth_m.shape
    x = np.arange(width, dtype=np.float32) - np.float32(K[0, 2])
    y = (np.arange(height, dtype=np.float32) - np.float32(K[1, 2]))[:, None]
    was = np.maximum(z - tz, np.float32(_NEAREST_M))
    out: Flow = np.dstack(
        ((x * tz - np.float32(K[0, 0]) * tx) / was, (y * tz - np.float32(K[1, 1]) * ty) / was)
    )
    return out

"""How still things move in the image when the lens itself moves, by their distance.

A neck turns about an axis some centimetres behind the lens: what is near then passes what
is far. With the older image turned as predicted, a point that is at X now, in the axes
of now, was seen at X - t, whatever it is part of; its depth says by how much that differs.
"""

import numpy as np

from gazerig.drivers.vision.motion.image import Floats, Plane
from gazerig.drivers.vision.motion.optical_flow import Flow

# Nearer than this no lens is sharp, and depth cameras invent.
_NEAREST_M = 0.1
# A lens that moves less than this between two images stands.
_STILL_M = 1e-4


def parallax(depth_m: Plane | None, K: Floats, t_now_before_m: Floats | None) -> Flow | None:
    """Return how far still things are from their place now in the older image, (h, w, 2).

    depth_m: (h, w), NaN where unknown: there the image's middle distance is taken
    t_now_before_m: (3,) where the lens was, seen from where it is, in its axes of now

    None where the lens stands, or nothing is known of depth or motion.
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

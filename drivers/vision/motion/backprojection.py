"""Back-projection of a moving patch to a thing in the camera frame, with position and velocity.

Camera frame: optical, x right, y down, z forward. With p = z (x', y', 1), where x' and y' are the
pixel divided by the focal length, the velocity is z (dx'/dt, dy'/dt, 0) + (dz/dt) (x', y', 1). A
thing that grows by a share per second approaches by that share: dz/dt = -loom z.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.clustering import PixelGroup
from gazerig.drivers.vision.motion.image import Floats, Plane
from gazerig.drivers.vision.motion.optical_flow import Flow

Vec3 = tuple[float, float, float]

ASSUMED_M, _ASSUMED_SPREAD = 2.0, 0.5
"""Distance assumed for things without a measured depth; its standard deviation as a share of it."""
# A depth image has holes and, at edges, the background; a tenth of a thing must have depth.
_LEAST_SHARE, _LEAST_PIXELS = 0.1, 5
_LEAST_SD_M = 0.005
# Median absolute deviation to standard deviation.
_MAD = 1.4826


class Distance(NamedTuple):
    """Distance of a thing along the optical axis, its standard deviation, and whether measured."""

    z_m: float
    sd_m: float
    is_measured: bool


def shrink_depth(depth_m: NDArray[Any] | None, shape: tuple[int, ...]) -> Plane | None:
    """Resize a depth image to the small image's size; invalid distances become NaN."""
    if depth_m is None or depth_m.ndim != 2 or depth_m.size == 0:
        return None
    depth = np.asarray(depth_m, dtype=np.float32)
    if depth.shape != shape:  # nearest neighbour, as the mean of two surfaces is on neither
        size = shape[1], shape[0]
        depth = np.asarray(cv2.resize(depth, size, interpolation=cv2.INTER_NEAREST), np.float32)
    out: Plane = np.where(np.isfinite(depth) & (depth > 0.0), depth, np.float32(np.nan))
    return out


def distance(group: PixelGroup, depth: Plane | None) -> Distance:
    """Return a thing's distance from the depth image, or the assumed one."""
    if depth is not None:
        values = depth[group.rows, group.columns]
        values = values[np.isfinite(values)]
        if len(values) >= max(_LEAST_PIXELS, _LEAST_SHARE * len(group.columns)):
            z = float(np.median(values))
            spread = _MAD * float(np.median(np.abs(values - z)))
            return Distance(z, max(_LEAST_SD_M, spread), True)
    return Distance(ASSUMED_M, ASSUMED_M * _ASSUMED_SPREAD, False)


def back_project(point_px: Floats, z_m: float, K: Floats) -> Vec3:
    """Return the point at depth ``z_m`` of a pixel."""
    x, y = ((point_px - K[:2, 2]) / K[[0, 1], [0, 1]]).tolist()
    return z_m * x, z_m * y, z_m


def velocity(p_m: Vec3, flow_px_s: tuple[float, float], loom_1_s: float, K: Floats) -> Vec3:
    """Return the velocity of a thing at ``p_m`` from the motion and growth of its image."""
    x, y, z = p_m
    return (
        z * flow_px_s[0] / float(K[0, 0]) - loom_1_s * x,
        z * flow_px_s[1] / float(K[1, 1]) - loom_1_s * y,
        -loom_1_s * z,
    )


def radius_m(area_px: float, z_m: float, K: Floats) -> float:
    """Return the radius of a disc with this area in the image."""
    return z_m * float(np.sqrt(area_px / (np.pi * K[0, 0] * K[1, 1])))


# At shorter distances no lens is sharp, and depth cameras return invalid values.
_NEAREST_M = 0.1
# A lens that moves less than this between two images is at rest.
_STILL_M = 1e-4


def parallax(depth_m: Plane | None, K: Floats, t_now_before_m: Floats | None) -> Flow | None:
    """Return the displacement of still things in the older image, (h, w, 2), pixels.

    A neck turns about an axis some centimetres behind the lens, so near things move relative to far
    ones. With the older image turned as predicted, a point that is now at X, in the present axes,
    was seen at X - t; the effect depends on its depth.

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

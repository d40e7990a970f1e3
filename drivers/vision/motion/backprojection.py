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

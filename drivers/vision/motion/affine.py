"""Slide, growth and spin of a patch of flow: a robust fit of an affine motion.

Between two images, points of a thing that turns fast move along arcs, not along tangents. So growth
and spin are computed from the whole map from now to before, as the logarithm of its scale and its
angle, not from the divergence and curl of the flow.
"""

from math import atan2, log, sqrt
from typing import NamedTuple

import numpy as np

from gazerig.drivers.vision.motion.image import Floats, upper_median
from gazerig.drivers.vision.motion.lucas_kanade import AffineWarp

# Flow at neighbouring pixels comes from the same patches: this area counts as one measurement (8 px
# at half size).
_PATCH_PX2 = 64.0
_TUKEY, _STEPS = 4.685, 4
_LEAST_POINTS = 6
# Smallest noise of flow.
_NOISE_PX = 0.03


class PatchMotion(NamedTuple):
    """Motion of a patch between two images.

    slide_px: motion of its centre
    growth: logarithm of the ratio of its size now to its size before
    spin_rad: rotation, positive clockwise in the image
    growth_sd, spin_sd: standard deviations
    residual_px: residual of the affine motion, along one axis
    """

    slide_px: tuple[float, float]
    growth: float
    spin_rad: float
    growth_sd: float
    spin_sd: float
    residual_px: float


def fit_affine_warp(
    places: Floats, flow: Floats, centre: Floats, area_px: float
) -> tuple[AffineWarp, float]:
    """Fit the map from now to before to flow at points; return it and its residual.

    places, flow: (n, 2) present positions, and their motion from the older image
    centre: (2,) point whose motion is the map's shift
    area_px: area that the points represent
    """
    arms = places - centre
    rows = np.column_stack((arms, np.ones(len(arms))))
    numbers, weights, rest = _fit(rows, flow)
    if numbers is None:
        return AffineWarp(np.eye(2), -np.median(flow, axis=0), np.inf), rest
    # Root mean square of the standard deviations of the map's slopes.
    inverse = np.linalg.inv(rows.T @ (rows * weights[:, None]) + 1e-9 * np.eye(3))
    points_a_patch = max(1.0, _PATCH_PX2 * len(rows) / max(area_px, 1.0))
    both = 0.5 * float(inverse[0, 0] + inverse[1, 1])
    return AffineWarp(
        np.eye(2) - numbers[:2].T, -numbers[2], rest * sqrt(max(both, 0.0) * points_a_patch)
    ), rest


def patch_motion(back: AffineWarp, residual_px: float) -> PatchMotion:
    """Return slide, growth and spin of a map from now to before."""
    (a, b), (c, d) = back.matrix.tolist()
    shrink = sqrt(max(abs(a * d - b * c), 1e-6))
    sd = back.slope_sd / sqrt(2.0)  # growth and spin are each half the sum of two numbers
    slide = float(-back.shift[0]), float(-back.shift[1])
    return PatchMotion(slide, -log(shrink), -atan2(c - b, a + d), sd, sd, residual_px)


def affine_residual(places: Floats, flow: Floats) -> float:
    """Return the residual of a flow after one affine motion, root mean square of the lengths."""
    if len(places) < _LEAST_POINTS:
        return 0.0
    rows = np.column_stack((places - places.mean(axis=0), np.ones(len(places))))
    numbers = np.linalg.solve(rows.T @ rows + 1e-9 * np.eye(3), rows.T @ flow)
    return float(np.sqrt(((flow - rows @ numbers) ** 2).sum(axis=1).mean()))


def _fit(rows: Floats, flow: Floats) -> tuple[Floats | None, Floats, float]:
    """Fit (3, 2) numbers by reweighted least squares; return them, the weights and the residual."""
    weights = np.ones(len(rows))
    numbers: Floats | None = None
    scale = _NOISE_PX
    for _ in range(_STEPS):
        weighted = rows * weights[:, None]
        normal = rows.T @ weighted
        # Points on a line have moments without an area.
        xx, xy, yy = normal[0, 0], normal[0, 1], normal[1, 1]
        flat = xx * yy - xy * xy <= 1e-6 * max(xx, yy) ** 2 + 1e-12
        if np.count_nonzero(weights) < _LEAST_POINTS or flat:
            return None, weights, scale
        numbers = np.asarray(np.linalg.solve(normal, weighted.T @ flow))
        errors = np.hypot(*(flow - rows @ numbers).T)
        scale = max(_NOISE_PX, upper_median(errors) / 1.177)
        weights = np.maximum(1.0 - (errors / (_TUKEY * scale)) ** 2, 0.0) ** 2
    return numbers, weights, scale

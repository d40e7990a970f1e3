"""Affine motion of a patch, refined on the brightness of its own pixels.

Flow is computed on patches that extend over a thing's edge, where its motion mixes with that of the
background; for a small thing that is most of it. So one affine map is fitted to all its pixels
(inverse compositional alignment, Baker and Matthews 2004), with Tukey's weights, which exclude
pixels of the background, first on blurred and then on sharp images.
"""

from math import atan2, log, sqrt
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.image import Floats, Grey, Plane, upper_median
from gazerig.drivers.vision.motion.optical_flow import ImagePair, warp_points

# (blur in pixels, most steps) at the level of each image; larger errors are not corrected.
_LEVELS = ((1.25, 8), (1.0, 6))
_TUKEY = 4.685
_LEAST_POINTS = 24
# Smallest noise of pixels, grey levels.
_LEAST_NOISE = 1.0
# The iteration ends at a step that moves no pixel by more than this.
_SMALL_PX = 0.02
# Standard deviations of the error of flow: its slide (pixels) and its slopes at a patch's radius.
_SLIDE_SD_PX, _SLOPE_SD_PX = 2.0, 3.0
# Neighbouring pixels of blurred images are correlated: this number is one measurement.
_ALIKE = 12.0
# Weak prior on the start; none on brightness.
_BELIEF = np.diag([_SLOPE_SD_PX**-2.0] * 4 + [_SLIDE_SD_PX**-2.0] * 2 + [1e-9])
# A homography counts as affine within a patch; distance at which its slopes are computed.
_STEP_PX = 8.0
_AROUND = np.array([(0.0, 0.0), (_STEP_PX, 0.0), (0.0, _STEP_PX)])
_ONE_MAP: Plane = np.empty(0, dtype=np.float32)
_EDGE = cv2.BORDER_REPLICATE


class AffineWarp(NamedTuple):
    """An affine map from present positions to earlier ones, without the camera's motion.

    matrix: (2, 2); shift: (2,): x -> centre + matrix (x - centre) + shift
    slope_sd: standard deviation of the matrix's numbers, root mean square
    """

    matrix: Floats
    shift: Floats
    slope_sd: float


class PyramidLevel(NamedTuple):
    """Two blurred images, and their scale relative to the images searched for flow."""

    now: Plane
    before: Plane
    scale: float
    steps: int


def blur_images(pair: ImagePair) -> tuple[PyramidLevel, ...]:
    """Blur the images once for all patches: at the searched size, then at the fine size."""
    (coarse_px, coarse_steps), (fine_px, fine_steps) = _LEVELS
    fine, scale = pair.fine_images, pair.fine_images[0].shape[0] / pair.now.shape[0]
    return (
        PyramidLevel(_blur(pair.now, coarse_px), _blur(pair.before, coarse_px), 1.0, coarse_steps),
        PyramidLevel(_blur(fine[0], fine_px), _blur(fine[1], fine_px), scale, fine_steps),
    )


class BackgroundWarp(NamedTuple):
    """Map of still things to the older image.

    B: (3, 3) present pixels to older ones
    """

    B: Floats

    def linearize(self, centre: Floats) -> tuple[Floats, Floats]:
        """Return (2, 2) and (2,): the map around a position, x -> there + slope (x - centre)."""
        at = warp_points(self.B, centre + _AROUND)
        return ((at[1:] - at[0]) / _STEP_PX).T, at[0]


def refine_warp(
    start: AffineWarp,
    places: Floats,
    centre: Floats,
    frames: tuple[PyramidLevel, ...],
    room: BackgroundWarp,
) -> AffineWarp:
    """Refine a map on the pixels at ``places``, (n, 2); return the start itself if that fails."""
    arms = places - centre
    size = max(1.0, float(np.sqrt((arms**2).sum(axis=1).mean())))
    if len(places) < _LEAST_POINTS:
        return start
    slope, there = room.linearize(centre)
    best = start
    for level in frames:
        fit = _refine_level(best, arms, centre, size, level, slope, there)
        if fit is None:
            return best
        best = fit
    return best


def _refine_level(
    start: AffineWarp,
    arms: Floats,
    centre: Floats,
    size: float,
    level: PyramidLevel,
    slope: Floats,
    there: Floats,
) -> AffineWarp | None:
    """Refine at one level; return None if it diverges or does not improve."""
    scale = level.scale
    at = _level_positions(arms + centre, scale).astype(np.intp)
    # Exact positions of the whole pixels.
    arms = (at + 0.5) / scale - 0.5 - centre
    wanted, slopes = _template(level.now, at, arms / size)
    matrix, shift = start.matrix, start.shift

    def errors() -> Floats:
        seen = arms @ (slope @ matrix).T + (there + slope @ shift)
        at = _level_positions(seen, scale).astype(np.float32)[:, None]
        found = cv2.remap(level.before, at, _ONE_MAP, cv2.INTER_LINEAR, None, _EDGE)
        out: Floats = wanted - found.ravel()
        return out

    off = errors()
    first, weights = _tukey_weights(off)
    noise, normal = first, np.eye(7)
    for _ in range(level.steps):
        weighted = slopes * weights[:, None]
        normal = slopes.T @ weighted + noise**2 * _BELIEF
        step = np.linalg.solve(normal, weighted.T @ off)
        change = np.eye(2) + step[:4].reshape(2, 2) / (size * scale)
        matrix = matrix @ change
        shift = shift + matrix @ step[4:6] / scale
        off = errors()
        noise, weights = _tukey_weights(off)
        if np.abs(step[:6]).max() < _SMALL_PX:
            break
    led_away = np.abs(matrix - start.matrix).max() * size * scale > 3 * _SLOPE_SD_PX
    led_away |= bool(np.abs(shift - start.shift).max() * scale > 3 * _SLIDE_SD_PX)
    if led_away or noise > first or not np.isfinite(matrix).all():
        return None
    spread = noise * np.sqrt(_ALIKE * np.linalg.inv(normal).diagonal()[:4].mean()) / (size * scale)
    return AffineWarp(matrix, shift, float(spread))


def _level_positions(places: Floats, scale: float) -> Floats:
    """Return positions of the searched image in a level's pixels."""
    return places if scale == 1.0 else (places + 0.5) * scale - 0.5


def _template(now: Plane, at: NDArray[np.intp], arms: Floats) -> tuple[Floats, Floats]:
    """Return brightness (n,), and its derivatives (n, 7) by the map's numbers and by light."""
    height, width = now.shape
    x, y = at.T
    right, left = np.minimum(x + 1, width - 1), np.maximum(x - 1, 0)
    below, above = np.minimum(y + 1, height - 1), np.maximum(y - 1, 0)
    gx = 0.5 * (now[y, right] - now[y, left]).astype(np.float64)
    gy = 0.5 * (now[below, x] - now[above, x]).astype(np.float64)
    u, v = arms.T
    slopes = np.column_stack((gx * u, gx * v, gy * u, gy * v, gx, gy, np.ones(len(x))))
    return now[y, x].astype(np.float64), slopes


def _tukey_weights(errors: Floats) -> tuple[float, Floats]:
    """Return the noise of errors without their mean, and Tukey's weights."""
    apart = np.abs(errors - upper_median(errors))
    noise = max(_LEAST_NOISE, 1.4826 * upper_median(apart))
    return noise, np.maximum(1.0 - (apart / (_TUKEY * noise)) ** 2, 0.0) ** 2


def _blur(grey: Grey, sigma: float) -> Plane:
    return np.asarray(cv2.GaussianBlur(grey.astype(np.float32), (0, 0), sigma), dtype=np.float32)


# Flow at neighbouring pixels comes from the same patches: this area counts as one measurement (8 px
# at half size).
_PATCH_PX2 = 64.0
_FLOW_TUKEY, _STEPS = 4.685, 4
_LEAST_FLOW_POINTS = 6
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
    numbers, weights, rest = _fit_robustly(rows, flow)
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
    """Return slide, growth and spin of a map from now to before.

    Between two images, points of a thing that turns fast move along arcs, not along tangents. So
    growth and spin are computed from the whole map from now to before, as the logarithm of its
    scale and its angle, not from the divergence and curl of the flow.
    """
    (a, b), (c, d) = back.matrix.tolist()
    shrink = sqrt(max(abs(a * d - b * c), 1e-6))
    sd = back.slope_sd / sqrt(2.0)  # growth and spin are each half the sum of two numbers
    slide = float(-back.shift[0]), float(-back.shift[1])
    return PatchMotion(slide, -log(shrink), -atan2(c - b, a + d), sd, sd, residual_px)


def affine_residual(places: Floats, flow: Floats) -> float:
    """Return the residual of a flow after one affine motion, root mean square of the lengths."""
    if len(places) < _LEAST_FLOW_POINTS:
        return 0.0
    rows = np.column_stack((places - places.mean(axis=0), np.ones(len(places))))
    numbers = np.linalg.solve(rows.T @ rows + 1e-9 * np.eye(3), rows.T @ flow)
    return float(np.sqrt(((flow - rows @ numbers) ** 2).sum(axis=1).mean()))


def _fit_robustly(rows: Floats, flow: Floats) -> tuple[Floats | None, Floats, float]:
    """Fit (3, 2) numbers by reweighted least squares; return them, the weights and the residual."""
    weights = np.ones(len(rows))
    numbers: Floats | None = None
    scale = _NOISE_PX
    for _ in range(_STEPS):
        weighted = rows * weights[:, None]
        normal = rows.T @ weighted
        if np.count_nonzero(weights) < _LEAST_FLOW_POINTS:
            return None, weights, scale
        # Points on a line have moments about their mean without an area.
        x, y, total = normal[2].tolist()
        (xx, xy), (_, yy) = (normal[:2, :2] - np.outer((x, y), (x, y)) / total).tolist()
        if xx * yy - xy * xy <= 1e-6 * max(xx, yy) ** 2 + 1e-12:
            return None, weights, scale
        numbers = np.asarray(np.linalg.solve(normal, weighted.T @ flow))
        errors = np.hypot(*(flow - rows @ numbers).T)
        scale = max(_NOISE_PX, upper_median(errors) / 1.177)
        weights = np.maximum(1.0 - (errors / (_FLOW_TUKEY * scale)) ** 2, 0.0) ** 2
    return numbers, weights, scale

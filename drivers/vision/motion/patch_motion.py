"""Motion of a patch between two images: slide, growth and spin.

Flow is computed on squares that extend over a thing's edge, where its motion mixes with that of the
background; for a small thing that is most of it. So one affine map is fitted to all its pixels
(inverse compositional alignment, Baker and Matthews 2004), with Tukey's weights, which exclude
pixels of the background. OpenCV's alignment
(findTransformECC) has no such weights: on drawn boxers its errors of velocity are twice as large.
"""

from math import atan2, log, sqrt
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.clustering import PixelGroup
from gazerig.drivers.vision.motion.flow import (
    TO_FINE,
    TO_SEARCHED,
    Floats,
    Grey,
    Plane,
    warp_points,
)

# Most points for a fit, and least for the refinement.
_SAMPLE, _LEAST_POINTS = 400, 24
# Flow at neighbouring pixels comes from the same squares: this area counts as one measurement (16
# px in the fine image); smallest noise of flow.
_SQUARE_PX2, _LEAST_FLOW_NOISE_PX = 256.0, 0.06
# Blur in pixels, and most steps; larger errors are not corrected.
_BLUR_PX, _STEPS = 1.25, 8
_TUKEY = 4.685
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


class PatchMotion(NamedTuple):
    """Motion of a patch between two images.

    slide_px: motion of its centre
    growth: logarithm of the ratio of its size now to its size before
    spin_rad: rotation, positive clockwise in the image
    sd: standard deviation of growth and of spin
    """

    slide_px: tuple[float, float]
    growth: float
    spin_rad: float
    sd: float


class _Affine(NamedTuple):
    """An affine map from present positions to earlier ones, without the camera's motion.

    matrix: (2, 2); shift: (2,): x -> centre + matrix (x - centre) + shift
    slope_sd: standard deviation of the matrix's numbers, root mean square
    """

    matrix: Floats
    shift: Floats
    slope_sd: float


def blur(grey: Grey) -> Plane:
    """Return an image without the finest detail, in which a fit would go astray."""
    soft = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), _BLUR_PX)
    return np.asarray(soft, dtype=np.float32)


def patch_motion(
    group: PixelGroup, centre: Floats, now: Plane, before: Plane, B: Floats
) -> PatchMotion:
    """Return the motion of a patch, without the camera's.

    Between two images, points of a thing that turns fast move along arcs, not along tangents. So
    growth and spin are computed from the whole map from now to before, as the logarithm of its
    scale and its angle, not from the divergence and curl of the flow.

    Args:
        group: Its pixels.
        centre: The point (2,) whose motion is the slide.
        now: The newer of the fine images, blurred.
        before: The older one, blurred.
        B: Homography of still things from the newer image to the older one.
    """
    count = len(group.columns)
    some = slice(None, None, max(1, count // _SAMPLE))
    # Everything is computed in pixels of the fine images.
    places = np.column_stack((2.0 * group.columns[some], 2.0 * group.rows[some]))
    flow, centre = 2.0 * group.flow[some], 2.0 * centre + 0.5
    arms = places - centre
    size = max(1.0, float(np.sqrt((arms**2).sum(axis=1).mean())))
    back = _fit_to_flow(arms, flow, size, 4 * count)
    if len(places) >= _LEAST_POINTS:
        at = warp_points(TO_FINE @ B @ TO_SEARCHED, centre + _AROUND)
        slope = ((at[1:] - at[0]) / _STEP_PX).T
        back = _refine(back, places, centre, size, now, before, slope, at[0])
    (a, b), (c, d) = back.matrix.tolist()
    shrink = sqrt(max(abs(a * d - b * c), 1e-6))
    slide = float(-back.shift[0]) / 2.0, float(-back.shift[1]) / 2.0
    # Growth and spin are each half the sum of two numbers.
    return PatchMotion(slide, -log(shrink), -atan2(c - b, a + d), back.slope_sd / sqrt(2.0))


def _fit_to_flow(arms: Floats, flow: Floats, size: float, area_px2: float) -> _Affine:
    """Fit a map to the flow of points around the centre."""
    fitted, _ = cv2.estimateAffine2D(arms, arms - flow, method=cv2.LMEDS)
    if fitted is None:
        return _Affine(np.eye(2), -np.median(flow, axis=0), np.inf)
    M = np.asarray(fitted, np.float64)
    errors = np.hypot(*(arms @ M[:, :2].T + M[:, 2] - arms + flow).T)
    noise_px = max(_LEAST_FLOW_NOISE_PX, float(np.median(errors)) / 1.177)
    # Half of the squares of the arms is along each axis.
    sd = noise_px / size * sqrt(2.0 / max(1.0, area_px2 / _SQUARE_PX2))
    return _Affine(M[:, :2], M[:, 2], sd)


def _refine(
    start: _Affine,
    places: Floats,
    centre: Floats,
    size: float,
    now: Plane,
    before: Plane,
    slope: Floats,
    there: Floats,
) -> _Affine:
    """Refine a map on the pixels of the images; unchanged if it diverges or does not improve.

    slope, there: map of still things to the older image, around the centre
    """
    arms = places - centre
    wanted, slopes = _template(now, places.astype(np.intp), arms / size)
    matrix, shift = start.matrix, start.shift

    def errors() -> Floats:
        at = arms @ (slope @ matrix).T + (there + slope @ shift)
        linear, edge = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
        found = cv2.remap(before, at.astype(np.float32)[:, None], _ONE_MAP, linear, None, edge)
        return np.asarray(wanted - found.ravel(), np.float64)

    off = errors()
    first, weights = _tukey_weights(off)
    noise, normal = first, np.eye(7)
    for _ in range(_STEPS):
        weighted = slopes * weights[:, None]
        normal = slopes.T @ weighted + noise**2 * _BELIEF
        step = np.linalg.solve(normal, weighted.T @ off)
        matrix = matrix @ (np.eye(2) + step[:4].reshape(2, 2) / size)
        shift = shift + matrix @ step[4:6]
        off = errors()
        noise, weights = _tukey_weights(off)
        if np.abs(step[:6]).max() < _SMALL_PX:
            break
    led_away = np.abs(matrix - start.matrix).max() * size > 3 * _SLOPE_SD_PX
    led_away |= bool(np.abs(shift - start.shift).max() > 3 * _SLIDE_SD_PX)
    if led_away or noise > first or not np.isfinite(matrix).all():
        return start
    spread = noise * np.sqrt(_ALIKE * np.linalg.inv(normal).diagonal()[:4].mean()) / size
    return _Affine(matrix, shift, float(spread))


def _template(now: Plane, at: NDArray[np.intp], arms: Floats) -> tuple[Floats, Floats]:
    """Return brightness (n,), and its derivatives (n, 7) by the map's numbers and by light."""
    x, y = at.T
    gx, gy = (cv2.Sobel(now, cv2.CV_64F, dx, 1 - dx, ksize=1, scale=0.5)[y, x] for dx in (1, 0))
    u, v = arms.T
    slopes = np.column_stack((gx * u, gx * v, gy * u, gy * v, gx, gy, np.ones(len(x))))
    return now[y, x].astype(np.float64), slopes


def _tukey_weights(errors: Floats) -> tuple[float, Floats]:
    """Return the noise of errors without their mean, and Tukey's weights."""
    apart = np.abs(errors - float(np.median(errors)))
    noise = max(_LEAST_NOISE, 1.4826 * float(np.median(apart)))
    return noise, np.maximum(1.0 - (apart / (_TUKEY * noise)) ** 2, 0.0) ** 2

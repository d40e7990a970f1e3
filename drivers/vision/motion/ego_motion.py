"""Estimation of the camera's own motion: the common motion of most of the still room.

The joints provide a first guess, which lags and does not include the sideways motion of the lens
when the neck turns. A homography is fitted to the remaining flow (exact for a turn and for one
plane, an approximation otherwise), by iteratively reweighted least squares with Tukey's weights.
The fit starts from the guess and from the scale of its usual error, so that a body that fills the
image is not mistaken for the room while the joints measure that the camera is at rest.

If too little agrees with the guess, or there is none, the whole image may have moved: the table was
bumped, or a hand holds the camera. Without a guess the camera counts as at rest while a good part
of the image is.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.flow import (
    Floats,
    ImagePair,
    warp_points,
)

_GRID_PX = 4
# Margin at the edge, where the flow is worst and leaves the image.
_EDGE_PX = 3
# Corner strength (smaller eigenvalue of the gradients' matrix, at half size) that noise of a few
# grey levels does not reach.
_CORNER_BLOCK = 5
_LEAST_CORNER = 2e-4
_LEAST_POINTS = 30
# The room surrounds the camera: anything in fewer of the image's 48 cells is a thing.
_CELLS, _LEAST_CELLS = (8, 6), 12
# Share of the textured points that must agree with the prediction.
_LEAST_SHARE = 0.35
_STEPS = 8
# The iteration ends at a step that moves the image by less.
_SMALL_PX = 0.01
_TUKEY = 4.685
_LEAST_NOISE_PX, _MOST_NOISE_PX = 0.02, 1.5
# Joints at rest are accurate; at the onset of motion they may be wrong by the whole motion.
_STANDING_REACH_PX = 0.4
# A fit with a larger residual is between two motions.
_MIXED_PX = 0.25
# Standard deviations of a homography's numbers, in focal lengths, which regularise it between
# points.
_SPREADS = np.array([0.1, 0.1, 0.2, 0.1, 0.1, 0.2, 0.05, 0.05])
_POINT_NOISE = 1e-3
_BELIEF = np.diag((_POINT_NOISE / _SPREADS) ** 2)
_PLAIN = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
# Requirements for accepting that the whole image moved, against or without the joints: share of the
# textured points that moved together, number of the image's cells with them, and largest share of
# the points at the edge that may have kept their position. A person close to the lens fills most of
# the image; a strip of wall that keeps its position shows that.
_MOVED_SHARE, _MOVED_CELLS, _KEPT_EDGE_SHARE = 0.45, 24, 0.1


class HomographyFit(NamedTuple):
    """Homography (3, 3), share of the points that agree with it, and their noise in pixels.

    is_independent: whether it was found independently of the prediction
    """

    B: Floats
    agreeing_share: float
    noise_px: float
    is_independent: bool


class EgoMotion(NamedTuple):
    """The camera's own motion between two images.

    B: (3, 3) pixels of the newer image to those of the older one, turned as predicted
    total: (3, 3) pixels of the older image to those of the newer
    background_share: share of the textured points that moved with the room; 0 if they only agree on
        noise
    noise_px: deviation of their flow from it, standard deviation along one axis
    shift_px: median motion of the image by the camera's motion
    unforeseen_px: the same motion if only the image shows it, otherwise 0
    """

    B: Floats
    total: Floats
    background_share: float
    noise_px: float
    shift_px: float
    unforeseen_px: float


def estimate_ego_motion(pair: ImagePair, K: Floats, predicted: bool) -> EgoMotion:
    """Find the camera's own motion.

    K: (3, 3) camera matrix
    predicted: whether ``pair`` was turned as the joints measured; otherwise the camera's motion is
        unknown, and the motion of most points is used instead
    """
    # Points (n, 2) of a grid with reliable flow.
    strength = cv2.cornerMinEigenVal(pair.now, _CORNER_BLOCK)
    height, width = pair.now.shape
    y, x = np.mgrid[_EDGE_PX : height - _EDGE_PX : _GRID_PX, _EDGE_PX : width - _EDGE_PX : _GRID_PX]
    x, y = x.ravel(), y.ravel()
    good = (strength[y, x] > _LEAST_CORNER) & pair.valid_mask[y, x]
    points = np.column_stack((x[good], y[good])).astype(np.float64)
    B, share, noise, free = np.eye(3), 1.0, _LEAST_NOISE_PX, False
    if len(points) >= _LEAST_POINTS:
        at = points[:, 1].astype(np.intp), points[:, 0].astype(np.intp)
        there = points + pair.flow[at]
        reach = _STANDING_REACH_PX + (_median_shift(_inverse(pair.H), points) if predicted else 0.0)
        found = _fit_room(points, there, K, pair.now.shape, reach, predicted)
        if found is not None:
            B, share, noise, free = found
            share = share if noise <= _MOST_NOISE_PX else 0.0
    back = _inverse(pair.H) @ B
    way = _median_shift(back, points) if len(points) else 0.0
    unforeseen = _median_shift(B, points) if free else 0.0
    total = _inverse(back)
    return EgoMotion(B, total / total[2, 2], share, noise, way, unforeseen)


def _fit_room(
    points: Floats,
    there: Floats,
    K: Floats,
    shape: tuple[int, ...],
    reach_px: float,
    predicted: bool,
) -> HomographyFit | None:
    """Fit the motion of the room: as predicted or at rest; otherwise that of the whole image."""
    off = np.hypot(*(there - points).T)
    near = off < reach_px
    stands = bool(near.mean() >= _LEAST_SHARE) and _count_cells(points[near], shape) >= _LEAST_CELLS
    fits = stands or predicted
    found = _fit_homography(points, there, K, shape, reach_px) if fits else None
    if found is not None and found.agreeing_share >= _LEAST_SHARE:
        return found
    free = _fit_homography(points, there, K, shape, np.inf, _MOVED_CELLS)
    if free is not None and free.noise_px > _MIXED_PX:
        free = _fit_two_motions(points, there, K, shape) or free
    if free is None or free.agreeing_share < _MOVED_SHARE:
        return found
    # Points that kept their position although the whole image seems to have moved.
    parted = np.hypot(*(warp_points(free.B, points) - points).T) > 2 * _STANDING_REACH_PX
    edge = _edge_mask(points, shape)
    kept = float(((off < _STANDING_REACH_PX) & parted)[edge].mean()) if edge.any() else 0.0
    return free if kept < _KEPT_EDGE_SHARE else found


def _fit_two_motions(
    points: Floats, there: Floats, K: Floats, shape: tuple[int, ...]
) -> HomographyFit | None:
    """Fit the room in an image with two motions: more of the edge moves with it.

    A close person fills the middle. The result is None without two motions, or if neither explains
    the image.
    """
    flow = there - points
    flow = flow - flow.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov(flow.T))
    side = flow @ axes[:, -1] > 0.0
    edge = _edge_mask(points, shape)
    best, most = None, 0.0
    for mine in (side, ~side):
        if np.count_nonzero(mine) < _LEAST_POINTS:
            continue
        start = _fit_homography(points[mine], there[mine], K, shape, np.inf)
        if start is None:
            continue
        left = warp_points(_inverse(start.B), there)
        rest = _fit_homography(points, left, K, shape, _STANDING_REACH_PX, _MOVED_CELLS)
        if rest is None or rest.noise_px > _MIXED_PX:
            continue
        B = start.B @ rest.B
        off = np.hypot(*(warp_points(B, points) - there).T)
        along = float((off[edge] < _STANDING_REACH_PX).mean()) if edge.any() else 0.0
        if along > most:
            best, most = HomographyFit(B / B[2, 2], rest.agreeing_share, rest.noise_px, True), along
    return best


def _fit_homography(
    points: Floats,
    there: Floats,
    K: Floats,
    shape: tuple[int, ...],
    reach_px: float,
    least_cells: int = _LEAST_CELLS,
) -> HomographyFit | None:
    """Fit the homography that most points agree with; return it, their share, and the noise.

    The result is None if they are too few, or all close together, as for a thing.
    """
    focal, centre = float(K[0, 0]), K[:2, 2]
    a, b = (points - centre) / focal, (there - centre) / focal
    # Rows (2 n, 8) of b (h6 x + h7 y + 1) = (h0 x + h1 y + h2, h3 x + h4 y + h5).
    plain, none = np.column_stack((a, np.ones(len(a)))), np.zeros((len(a), 3))
    rows = np.vstack(
        (
            np.hstack((plain, none, -a * b[:, :1])),
            np.hstack((none, plain, -a * b[:, 1:])),
        )
    )
    h = _PLAIN
    errors = focal * np.hypot(*(b - a).T)
    # At worst a third of the points is room; their error is the initial scale.
    scale = min(1.5 * float(np.quantile(errors, 0.3)), reach_px / 3) + 2 * _LEAST_NOISE_PX
    noise = _LEAST_NOISE_PX
    for _ in range(_STEPS):
        weights = np.maximum(1.0 - (errors / (_TUKEY * scale)) ** 2, 0.0) ** 2
        if np.count_nonzero(weights) < _LEAST_POINTS:
            return None
        # The eight numbers, with a weak prior of no motion.
        weighted = rows * np.tile(weights, 2)[:, None]
        right = weighted.T @ b.T.ravel() + _BELIEF @ _PLAIN
        last, h = h, np.asarray(np.linalg.solve(rows.T @ weighted + _BELIEF, right))
        errors = focal * np.hypot(*(warp_points(np.append(h, 1.0).reshape(3, 3), a) - b).T)
        done = np.abs(h - last).max() * focal < _SMALL_PX and scale < 2 * noise
        noise = _noise_px(errors, weights > 0.0)
        scale = min(scale, max(0.5 * scale, noise))
        if done:
            break
    near = errors < _TUKEY * scale
    if _count_cells(points[near], shape) < least_cells:
        return None
    square = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    B = square @ np.append(h, 1.0).reshape(3, 3) @ np.linalg.inv(square)
    return HomographyFit(
        B / B[2, 2], float(near.mean()), _noise_px(errors, near), reach_px == np.inf
    )


def _noise_px(errors: Floats, mask: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    """Return the standard deviation along one axis: the median length is 1.18 times it."""
    return max(_LEAST_NOISE_PX, float(np.median(errors[mask])) / 1.177)


def _edge_mask(points: Floats, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return a mask of points at the left, right or upper edge, where the room is most visible."""
    x, y = np.floor(points / (shape[1], shape[0]) * _CELLS).T
    out: NDArray[np.bool_] = (x == 0) | (x == _CELLS[0] - 1) | (y == 0)
    return out


def _count_cells(points: Floats, shape: tuple[int, ...]) -> int:
    """Return the number of cells of an image of (height, width) that contain points."""
    cells = np.floor(points / (shape[1], shape[0]) * _CELLS)
    return len(np.unique(cells[:, 0] * _CELLS[1] + cells[:, 1]))


def _inverse(H: Floats) -> Floats:
    return np.asarray(np.linalg.inv(H), dtype=np.float64)


def _median_shift(H: Floats, points: Floats) -> float:
    return float(np.median(np.hypot(*(warp_points(H, points) - points).T)))

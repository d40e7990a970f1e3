"""Clustering of moving pixels to things: neighbours belong together, unless they separate.

Pixels that one affine motion explains are one thing, however it turns or grows. Pixels with two
clearly different motions are two things, such as people who pass each other.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.flow import Floats, Flow, Grey, Mask
from gazerig.drivers.vision.motion.segmentation import MotionMask

Indices = NDArray[np.intp]

# Two motions are two things if they differ by this share of the faster one ...
_PARTING_SHARE = 0.8
# ... and their residual is below this share of that of one motion.
_BETTER_SHARE = 0.6
_MOST_SPLITS = 3
# Smallest moving region that is reported, as a share of the image's area.
_LEAST_AREA_SHARE = 0.001
# Moving regions closer to each other are merged, in pixels of the scaled-down image.
_CLOSE_PX = 7
MOST_BLOBS = 8
"""Most moving regions reported; the largest are chosen."""
# Number of patches that are examined per reported one.
_LOOKED_AT = 3
_SMOOTH_PX = 3
_LEAST_FLOW_POINTS = 6
# Relative change of brightness at the edges of a thing that is not a faint shadow, and the share of
# the image above which less is enough: near things are large, with soft edges.
_LEAST_CHANGE, _SMALL_SHARE = 0.13, 0.008
_SAMPLE = 400
# Distance from the image's edge, where flow is unknown, at which a patch continues beyond it.
_CUT_PX = 3
_HOLES = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))


class PixelGroup(NamedTuple):
    """Pixels that move together.

    columns, rows: (n,) columns and rows
    flow: (n, 2) their motion from the older image to the newer, pixels
    """

    columns: Indices
    rows: Indices
    flow: Floats

    @property
    def box(self) -> tuple[int, int, int, int]:
        """Return x, y, width and height of the pixels' box."""
        x, y = int(self.columns.min()), int(self.rows.min())
        return x, y, int(self.columns.max()) - x + 1, int(self.rows.max()) - y + 1


def fastest_quarter(group: PixelGroup) -> tuple[Floats, Floats]:
    """Return the mean position and the mean motion, (2,) each, of a group's fastest quarter."""
    speed = (group.flow * group.flow).sum(axis=1)
    fast = speed >= np.partition(speed, (3 * len(speed)) // 4)[(3 * len(speed)) // 4]
    at: Floats = np.array((group.columns[fast].mean(), group.rows[fast].mean()))
    flow: Floats = group.flow[fast].mean(axis=0).astype(np.float64)
    return at, flow


def cluster_motion(things: MotionMask, shrink: int) -> list[PixelGroup]:
    """Return the moving things, the largest first.

    shrink: pixels of the scaled-down image for one of the searched one
    """
    least = max(4, round(_LEAST_AREA_SHARE * things.mask.size))
    pieces = [
        piece
        for group in _connected_groups(
            things.mask, things.flow, _CLOSE_PX // shrink | 1, least, _LOOKED_AT * MOST_BLOBS
        )
        for piece in _split(group, things, least, _MOST_SPLITS)
    ]
    if things.change is not None:
        small = _SMALL_SHARE * things.mask.size
        pieces = [
            piece
            for piece in pieces
            if _percentile_97(things.change[piece.rows, piece.columns])
            > (_LEAST_CHANGE * min(1.0, small / len(piece.columns))) ** 2
        ]
    pieces.sort(key=lambda group: (-len(group.columns), group.columns[0], group.rows[0]))
    return pieces[:MOST_BLOBS]


def _percentile_97(values: NDArray[np.float32]) -> float:
    """Return the 97th percentile of values."""
    at = int(0.97 * len(values))
    return float(np.partition(values, at)[at])


def _connected_groups(
    mask: Mask, flow: Flow, close_px: int, least: int, most: int = 100
) -> list[PixelGroup]:
    """Return the connected components of the mask; gaps up to ``close_px`` are bridged.

    At most ``most`` groups are returned, the largest ones.
    """
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (close_px, close_px))
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(closed)
    areas = stats[1:, cv2.CC_STAT_AREA]
    groups = []
    for k in (np.argsort(-areas, kind="stable")[:most] + 1).tolist():
        if areas[k - 1] < least:
            break
        left, top, width, height = (int(v) for v in stats[k, :4])
        window = np.s_[top : top + height, left : left + width]
        y, x = np.nonzero((labels[window] == k) & mask[window])
        if len(x) >= least:
            x, y = x + left, y + top
            groups.append(PixelGroup(x, y, flow[y, x].astype(np.float64)))
    return groups


def _split(group: PixelGroup, things: MotionMask, least: int, splits: int) -> list[PixelGroup]:
    """Split a group of several motions recursively."""
    if splits == 0 or len(group.columns) < 2 * least:
        return [group]
    sides = _first_thing_mask(group, things.threshold_px)
    if sides is None:
        return [group]
    left, top, width, height = group.box
    parts = []
    for side in (sides, ~sides):
        mask = np.zeros((height, width), dtype=np.uint8)
        mask[group.rows[side] - top, group.columns[side] - left] = 255
        own = cv2.medianBlur(mask, _SMOOTH_PX) > 0
        flow = things.flow[top : top + height, left : left + width]
        for piece in _connected_groups(own, flow, _SMOOTH_PX, least):
            parts.append(PixelGroup(piece.columns + left, piece.rows + top, piece.flow))
    if len(parts) < 2:
        return [group]
    return [piece for part in parts for piece in _split(part, things, least, splits - 1)]


def _first_thing_mask(group: PixelGroup, threshold_px: float) -> Mask | None:
    """Return a mask of the first of two things; None if there is only one."""
    step = max(1, len(group.columns) // _SAMPLE)
    places = np.column_stack((group.columns, group.rows)).astype(np.float64)
    flow = group.flow
    together = affine_residual(places[::step], flow[::step])
    if together < threshold_px:
        return None
    middle = flow.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((flow - middle).T))
    sides: Mask = (flow - middle) @ axes[:, -1] > 0.0
    share = float(sides.mean())
    if not 0.0 < share < 1.0:
        return None
    a, b = flow[sides].mean(axis=0), flow[~sides].mean(axis=0)
    faster = max(float(np.hypot(*a)), float(np.hypot(*b)))
    if float(np.hypot(*(a - b))) < _PARTING_SHARE * faster:
        return None
    rests = [affine_residual(places[side][::step], flow[side][::step]) for side in (sides, ~sides)]
    apart = np.sqrt(share * rests[0] ** 2 + (1.0 - share) * rests[1] ** 2)
    return sides if apart < _BETTER_SHARE * together else None


def affine_residual(places: Floats, flow: Floats) -> float:
    """Return the residual of a flow after one affine motion, root mean square of the lengths."""
    if len(places) < _LEAST_FLOW_POINTS:
        return 0.0
    rows = np.column_stack((places - places.mean(axis=0), np.ones(len(places))))
    numbers = np.linalg.solve(rows.T @ rows + 1e-9 * np.eye(3), rows.T @ flow)
    return float(np.sqrt(((flow - rows @ numbers) ** 2).sum(axis=1).mean()))


def inscribed_radius_px(group: PixelGroup, shape: tuple[int, ...]) -> float:
    """Return the radius of the largest disc within a patch, continued beyond the image's edge.

    Args:
        group: The patch.
        shape: Height and width of the image.
    """
    x, y, width, height = group.box
    mask = np.zeros((height + 2, width + 2), np.uint8)
    inner = mask[1:-1, 1:-1]
    inner[group.rows - y, group.columns - x] = 1
    inner[:] = cv2.morphologyEx(inner, cv2.MORPH_CLOSE, _HOLES)
    if x <= _CUT_PX:
        _extend_beyond_edge(mask[:, 0], mask[:, 1])
    if x + width >= shape[1] - _CUT_PX:
        _extend_beyond_edge(mask[:, -1], mask[:, -2])
    if y <= _CUT_PX:
        _extend_beyond_edge(mask[0], mask[1])
    if y + height >= shape[0] - _CUT_PX:
        _extend_beyond_edge(mask[-1], mask[-2])
    # Plain skin shows no flow: an area surrounded by motion moves too.
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(mask, outlines, -1, 1, cv2.FILLED)
    return float(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_3).max())


def _extend_beyond_edge(beyond: NDArray[np.uint8], edge: NDArray[np.uint8]) -> None:
    """Extend a patch that the image's edge cuts beyond it in one piece."""
    at = np.flatnonzero(edge)
    beyond[at[0] : at[-1] + 1] = 1


_MARGIN_PX = 4
# Smallest difference of a thing's pixels from the background (standard deviations, grey levels).
_UNLIKE, _LEAST_LEVELS = 2.0, 12.0
# Smallest share of a thing that must differ for its appearance to be used.
_LEAST_SHARE = 0.25
# Share of the last image's choice that is kept, so that the point does not jump back and forth.
_KEPT = 0.5


def thing_pixel(group: PixelGroup, grey: Grey, middle: Floats, offset: Floats) -> Floats:
    """Return a pixel of the thing, (2,), near its centre.

    Plain background between two people who walk together, or between legs, moves with them in the
    flow. It is recognised by its appearance: it is as bright as the background around the patch.

    grey: (h, w) image
    middle: (2,) centre of the patch
    offset: (2,) offset of the point from its centre in the previous image
    """
    # Pixels of the patch that differ in brightness from the background.
    x, y, width, height = group.box
    left, top = max(0, x - _MARGIN_PX), max(0, y - _MARGIN_PX)
    crop = grey[top : y + height + _MARGIN_PX, left : x + width + _MARGIN_PX].astype(np.float32)
    outside = np.ones(crop.shape, dtype=np.float32)
    outside[group.rows - top, group.columns - left] = 0.0
    window = width + 2 * _MARGIN_PX, 2 * _MARGIN_PX + 1  # background is in horizontal strips
    edge = cv2.BORDER_CONSTANT
    count = np.maximum(cv2.blur(outside, window, borderType=edge), 1e-6)
    mean = cv2.blur(crop * outside, window, borderType=edge) / count
    square = cv2.blur(crop * crop * outside, window, borderType=edge) / count
    spread = np.sqrt(np.maximum(square - mean * mean, 0.0))
    unlike = np.abs(cv2.blur(crop, (3, 3)) - mean) > np.maximum(_UNLIKE * spread, _LEAST_LEVELS)
    apart: Mask = unlike[group.rows - top, group.columns - left]
    if apart.mean() < _LEAST_SHARE:
        apart[:] = True
    places = np.column_stack((group.columns[apart], group.rows[apart])).astype(np.float64)
    wanted = middle + _KEPT * offset
    out: Floats = places[int(np.argmin(((places - wanted) ** 2).sum(axis=1)))]
    return out

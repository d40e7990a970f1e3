"""Clustering of moving pixels to things: neighbours belong together."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.flow import Floats, Mask
from gazerig.drivers.vision.motion.segmentation import MotionMask

Indices = NDArray[np.intp]

# Smallest moving region that is reported, as a share of the image's area.
_LEAST_AREA_SHARE = 0.001
# Moving regions closer to each other are merged, in pixels of the scaled-down image.
_CLOSE_PX = 3
# Surroundings of a pixel, and difference from their motion as a share of its own, from which on two
# things meet.
_AROUND_PX, _PARTED_SHARE = 5, 0.3
MOST_BLOBS = 8
"""Most moving regions reported; the largest are chosen."""
# Number of regions that are examined: some are shadows.
_LOOKED_AT = 3 * MOST_BLOBS
# Relative change of brightness at the edges of a thing that is not a faint shadow, and the share of
# the image above which less is enough: near things are large, with soft edges.
_LEAST_CHANGE, _SMALL_SHARE = 0.13, 0.008
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
    fast = speed >= np.quantile(speed, 0.75)
    at: Floats = np.array((group.columns[fast].mean(), group.rows[fast].mean()))
    flow: Floats = group.flow[fast].mean(axis=0).astype(np.float64)
    return at, flow


def cluster_motion(things: MotionMask) -> list[PixelGroup]:
    """Return the moving things, the largest first: pixels whose gaps are up to ``_CLOSE_PX``."""
    least = max(4, round(_LEAST_AREA_SHARE * things.mask.size))
    small = _SMALL_SHARE * things.mask.size
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_CLOSE_PX, _CLOSE_PX))
    mask = things.mask & ~_parting_mask(things)
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(closed)
    areas = stats[1:, cv2.CC_STAT_AREA]
    # Pixels where two things meet belong to one of them.
    grown = cv2.dilate(labels.astype(np.float32), np.ones((_AROUND_PX, _AROUND_PX), np.uint8))
    labels = np.where(labels > 0, labels, grown)
    groups: list[PixelGroup] = []
    for k in (np.argsort(-areas, kind="stable")[:_LOOKED_AT] + 1).tolist():
        y, x = np.nonzero((labels == k) & things.mask)
        if len(x) < least:
            continue
        change = float(np.quantile(things.change[y, x], 0.97))
        if change > (_LEAST_CHANGE * min(1.0, small / len(x))) ** 2:
            groups.append(PixelGroup(x, y, things.flow[y, x].astype(np.float64)))
    return groups[:MOST_BLOBS]


def _parting_mask(things: MotionMask) -> Mask:
    """Return a mask of pixels that move otherwise than their surroundings: where two things meet.

    What turns or grows moves like the mean of its surroundings.
    """
    window = _AROUND_PX, _AROUND_PX
    flow = np.where(things.mask[..., None], things.flow, np.float32(0.0))
    share = np.maximum(cv2.blur(things.mask.astype(np.float32), window), np.float32(1e-6))
    off = flow - cv2.blur(flow, window) / share[..., None]
    out: Mask = np.linalg.norm(off, axis=2) > _PARTED_SHARE * np.linalg.norm(flow, axis=2)
    return out


def inscribed_radius_px(group: PixelGroup, shape: tuple[int, ...]) -> float:
    """Return the radius of the largest disc within a patch, continued beyond the image's edge.

    Args:
        group: The patch.
        shape: Height and width of the image.
    """
    mask = np.zeros(shape, np.uint8)
    mask[group.rows, group.columns] = 1
    within = mask[_CUT_PX:-_CUT_PX, _CUT_PX:-_CUT_PX]
    edges = (_CUT_PX,) * 4
    mask = np.asarray(cv2.copyMakeBorder(within, *edges, cv2.BORDER_REPLICATE), np.uint8)
    mask = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _HOLES), np.uint8)
    # Plain skin shows no flow: an area surrounded by motion moves too.
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(mask, outlines, -1, 1, cv2.FILLED)
    return float(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_3).max())


def thing_pixel(group: PixelGroup, middle: Floats) -> Floats:
    """Return the pixel of a thing, (2,), that is nearest to its centre."""
    places = np.column_stack((group.columns, group.rows)).astype(np.float64)
    out: Floats = places[int(np.argmin(((places - middle) ** 2).sum(axis=1)))]
    return out

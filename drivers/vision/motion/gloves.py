"""Detection of red boxing gloves by their colour, with direction and distance, moving or still.

Optical flow hardly measures the growth of a glove of one colour, and does not find one at rest. A
glove is nearly round, so the largest circle within it gives its direction and, by its size, its
distance. White and shiny parts belong to it; red ropes and posts do not. If one glove is in front
of another, both are found while enough of the farther one is visible. A glove that is partly hidden
by the image's edge, another glove or something else keeps its last size: it does not come nearer
because more of it becomes visible. The uncertainty of its distance increases meanwhile.
"""

from math import hypot
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray, MovingBlob

KIND = "hand"
RADIUS_M = 0.068
"""Radius of the largest ball within a glove."""

_FARTHEST_M = 1.3
_FIRST_ID = 2_000_000  # above those of moving things
_MOST = 4
# Range of red in any light: half-degrees of hue, saturation and value.
_LOW = ((0, 150, 50), (172, 150, 50))
_HIGH = ((7, 255, 255), (179, 255, 255))
# Factor on the largest circle within which the rest of a glove is not another glove.
_TAKEN = 1.35
# Largest motion of a glove between frames, in its radii; time for which its number is kept.
_MOVES, _KEPT_S = 2.5, 0.5
_EDGE_PX = 0.7
"""Uncertainty of the edge of a colour: standard deviation of the radius."""
_UNSEEN_M_S = 1.0
"""Speed of a glove along the line of sight while its size is not visible: standard deviation."""
# White and pale red: least value, greatest saturation of white, greatest half-degrees off red.
_PALE_VALUE, _WHITE_SATURATION, _PALE_HUE = 90, 80, 10
_THIN = 0.25
"""Share of the smallest glove's width below which a shape is a rope or a seam."""
_ROUND = 1.55
"""Largest extent of a completely visible glove, in radii of that circle from its centre."""


# Largest extent of a glove in radii of the circle.
_BEYOND = 1.2


class Circle(NamedTuple):
    """A circle within a glove, pixels of the frame that was searched.

    radius: radius if the glove continues beyond the edge of the image
    visible_radius: radius of the largest circle that is within the image
    """

    x: float
    y: float
    radius: float
    visible_radius: float


class _Glove(NamedTuple):
    """A circle in the image, pixels of the frame that was searched.

    sized_s: time of the last measurement of its radius; after that it was partly hidden
    """

    id: int
    x: float
    y: float
    radius: float
    seen_s: float
    sized_s: float


class GloveDetector:
    """Detector of red gloves in consecutive images."""

    def __init__(self) -> None:
        self._known: list[_Glove] = []
        self._next_id = _FIRST_ID

    def forget(self) -> None:
        """Discard all gloves; numbers are not reused."""
        self._known = []

    def add_gloves(
        self,
        blobs: tuple[MovingBlob, ...],
        bgr: ImageArray,
        captured_s: float,
        lens: Intrinsics,
        work_px: int,
    ) -> tuple[MovingBlob, ...]:
        """Return the gloves, as ``find`` does, and the other moving things."""
        gloves = self.find(bgr, captured_s, lens, work_px)
        return (*gloves, *exclude_gloves(blobs, gloves))

    def find(
        self, bgr: ImageArray, captured_s: float, lens: Intrinsics, work_px: int
    ) -> tuple[MovingBlob, ...]:
        """Return the gloves in an image, the nearest first.

        Args:
            bgr: Image (h, w, 3).
            captured_s: Time of its capture, seconds.
            lens: Focal lengths and centre in its pixels.
            work_px: Longest side above which an image is scaled down to it.
        """
        share = min(1.0, work_px / max(bgr.shape[:2]))
        small = bgr
        if share < 1.0:
            size = round(share * bgr.shape[1]), round(share * bgr.shape[0])
            small = np.asarray(cv2.resize(small, size, interpolation=cv2.INTER_AREA), np.uint8)
        least = share * lens.fx_px * RADIUS_M / _FARTHEST_M
        mask = _glove_mask(small, least)
        circles = _circles(mask.copy(), least)
        gloves = []
        height, width = small.shape[:2]
        for row, circle in enumerate(circles):
            edge = _BEYOND * circle.radius
            cut = not (edge < circle.x < width - edge and edge < circle.y < height - edge)
            hidden = (
                cut
                or any(
                    np.hypot(circle.x - one.x, circle.y - one.y)
                    < _TAKEN * one.radius + _BEYOND * circle.radius
                    for one in circles[:row]
                )
                or not _is_whole(mask, row, circles)
            )
            # The number is that of the nearest earlier glove. A partly hidden glove keeps its last
            # size, or that of its visible part; without either it is omitted.
            x, y, radius, sure = circle
            near = [
                (away, one)
                for one in self._known
                if (away := np.hypot(one.x - x, one.y - y)) < _MOVES * max(radius, one.radius)
            ]
            number, sized_s = self._next_id, captured_s
            if near:
                _, before = min(near)
                self._known.remove(before)
                number = before.id
                if hidden:
                    radius = max(sure, before.radius)
                    sized_s = captured_s if sure > before.radius else before.sized_s
            elif hidden:
                continue
            else:
                self._next_id += 1
            gloves.append(_Glove(number, x, y, radius, captured_s, sized_s))
        found = {glove.id for glove in gloves}
        rest = [
            one for one in self._known if one.id not in found and captured_s - one.seen_s <= _KEPT_S
        ]
        self._known = [*gloves, *rest]
        return tuple(_blob(glove, share, lens) for glove in gloves)


def _glove_mask(bgr: ImageArray, least_px: float) -> NDArray[np.uint8]:
    """Return a mask of gloves: red, and pale within the outline of the red."""
    hsv = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
    low, high = (
        cv2.inRange(hsv, np.array(a), np.array(b)) for a, b in zip(_LOW, _HIGH, strict=True)
    )
    thin = 2 * round(_THIN * least_px) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (thin, thin))
    calm = cv2.medianBlur(cv2.bitwise_or(low, high), 3)
    red = np.asarray(cv2.morphologyEx(calm, cv2.MORPH_OPEN, disc), np.uint8)
    outlines, _ = cv2.findContours(red, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    for outline in outlines:
        if cv2.contourArea(outline) < np.pi * least_px**2:
            continue
        x, y, width, height = cv2.boundingRect(outline)
        window = np.s_[y : y + height, x : x + width]
        inside = np.zeros((height, width), np.uint8)
        cv2.fillConvexPoly(inside, cv2.convexHull(outline) - (x, y), 255)
        hue, saturation, value = cv2.split(hsv[window])
        reddish = np.minimum(hue, 179 - hue) <= _PALE_HUE
        pale = (value >= _PALE_VALUE) & (reddish | (saturation <= _WHITE_SATURATION))
        red[window] |= inside & np.where(pale, np.uint8(255), np.uint8(0))
    return red


def _circles(mask: NDArray[np.uint8], least_px: float) -> list[Circle]:
    """Return the largest circles within a mask that do not overlap: x, y, radius."""
    found: list[Circle] = []
    # It is unknown whether areas beyond the image's edge belong to a glove.
    within = cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    while len(found) < _MOST:
        inside = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        _, radius, _, (x, y) = cv2.minMaxLoc(inside)
        if radius < least_px:
            break
        # The distance is to the centre of the nearest pixel outside, half a pixel beyond the edge.
        reach = int(radius)
        near = np.s_[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
        sure = min(float(radius), float(within[near].max())) - 0.5
        found.append(Circle(float(x), float(y), float(radius) - 0.5, sure))
        cv2.circle(mask, (x, y), int(np.ceil(_TAKEN * radius)), 0, -1)
    return found


def _is_whole(mask: NDArray[np.uint8], row: int, circles: list[Circle]) -> bool:
    """Return whether a glove is nearly round, so that nothing in front hides a part of it.

    Args:
        mask: Mask of gloves.
        row: Index of its circle.
        circles: Circles of all gloves; pixels nearer to another one, relative to its size, belong
            to that.
    """
    x, y, radius, _ = circles[row]
    far = 2.5 * radius
    left, top = max(0, round(x - far)), max(0, round(y - far))
    v, u = np.nonzero(mask[top : round(y + far) + 1, left : round(x + far) + 1])
    off = [np.hypot(u + left - a, v + top - b) / size for a, b, size, _ in circles]
    mine = off[row] <= np.min(off, axis=0)
    points = np.column_stack((u[mine], v[mine])).astype(np.float32)
    if not len(points):
        return False
    _, reach = cv2.minEnclosingCircle(points)
    return bool(reach <= _ROUND * radius)


def _blob(glove: _Glove, share: float, lens: Intrinsics) -> MovingBlob:
    """Return a glove in the camera's axes."""
    radius = glove.radius / share
    u, v = (glove.x + 0.5) / share - 0.5, (glove.y + 0.5) / share - 0.5
    z = lens.fx_px * RADIUS_M / radius
    place = (z * (u - lens.cx_px) / lens.fx_px, z * (v - lens.cy_px) / lens.fy_px, z)
    return MovingBlob(
        glove.id,
        KIND,
        place,
        RADIUS_M,
        depth_sd_m=hypot(z * _EDGE_PX / glove.radius, _UNSEEN_M_S * (glove.seen_s - glove.sized_s)),
        box_px=(u - radius, v - radius, 2.0 * radius, 2.0 * radius),
        centre_px=(u, v),
        area_px=float(np.pi) * radius**2,
    )


def exclude_gloves(
    blobs: tuple[MovingBlob, ...], gloves: tuple[MovingBlob, ...]
) -> tuple[MovingBlob, ...]:
    """Return the moving things that contain no glove, as arm and trunk move with one."""
    return tuple(
        blob for blob in blobs if not any(_contains_glove(blob, glove) for glove in gloves)
    )


def _contains_glove(blob: MovingBlob, glove: MovingBlob) -> bool:
    if blob.box_px is None or glove.centre_px is None:
        return False
    (x, y, width, height), (u, v) = blob.box_px, glove.centre_px
    return x <= u <= x + width and y <= v <= y + height

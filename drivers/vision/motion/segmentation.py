"""Segmentation of independently moving pixels: residual flow that the images confirm.

Flow is computed everywhere, even on plain walls, where it has no meaning. A pixel counts if its
flow differs from the camera's, if the camera's own motion does not explain the newer image there,
and if the flow does. Flickering light, except for edges of shadows, changes the image and is not
explained by any flow.
"""

from typing import NamedTuple

import cv2
import numpy as np

from gazerig.drivers.vision.motion.ego_motion import EgoMotion
from gazerig.drivers.vision.motion.flow import (
    Floats,
    Flow,
    Grey,
    ImagePair,
    Mask,
    Plane,
    gradients,
    remove_illumination,
)

LEAST_FLOW_PX = 0.25
"""Smallest displacement that counts as motion, in pixels of the scaled-down image."""
# Ratio to the noise of the flow on the still background that motion must exceed.
_NOISE_FACTOR = 5.0
# Threshold as a share of the camera's own motion: still things nearer than the background move
# relative to it when the head turns.
_PARALLAX_SHARE = 0.1
# Window in which brightness is compared: wide enough to average noise, narrow enough for a hand.
_WINDOW_PX = 3
# Window for edges and light.
_NEAR_PX = 5
# Largest residual of the flow, as a share of the change that the camera does not explain.
_LEFT_SHARE = 0.5
# Smallest ratio of a change to the noise (variances), and a grey level for rounding.
_NOISE_RATIO, _ROUNDING = 3.0, 1.0
# Share by which a static object behind most of the room moves less in the picture than the room.
_BEHIND = 0.03
# Share of a motion that must be across the edges there.
_ACROSS = 0.15
# Grey level below which relative changes are noise.
_DARK = np.float32(8.0)
# A camera that moved the image by less is at rest.
_STANDS_PX = 0.01
_ONE_MAP: Plane = np.empty(0, dtype=np.float32)
_EDGE = cv2.BORDER_REPLICATE


class MotionMask(NamedTuple):
    """Independent motion in an image.

    flow: (h, w, 2) motion from the older image to the newer, without the camera's, pixels
    mask: (h, w) pixels with confirmed motion
    threshold_px: smallest detectable motion
    change: (h, w) square of the relative change of brightness, without light; None: not computed
    """

    flow: Flow
    mask: Mask
    threshold_px: float
    change: Plane | None = None


class ImageDifference(NamedTuple):
    """Difference between the images, with the room at rest.

    mean_squares: (h, w) local mean of squares, grey levels
    noise: their usual value
    """

    mean_squares: Plane
    noise: float

    @property
    def changed_mask(self) -> Mask:
        """Return a mask of changes above the noise."""
        return self.mean_squares > _NOISE_RATIO * self.noise


def image_difference(pair: ImagePair, there: Flow | None = None) -> ImageDifference:
    """Compare two images.

    Args:
        pair: The images.
        there: Positions (h, w, 2) of still things in the older one; None: unchanged.
    """
    squares = _mean_squares(pair.now, pair.before, there)
    return ImageDifference(squares, _ROUNDING + float(np.quantile(squares[::4, ::4], 0.3)))


def segment_motion(
    pair: ImagePair,
    ego: EgoMotion,
    shrink: int,
    by_image: bool = False,
    still: ImageDifference | None = None,
) -> MotionMask:
    """Return the flow without ego-motion, masked by confirmation from both frames.

    Args:
        pair: The two images and their flow.
        ego: The camera's own motion.
        shrink: Pixels of the scaled-down image for one of the searched one.
        by_image: Whether only the image shows that motion. In that case any motion that a still,
            nearer thing cannot have (against the room or across its motion) counts.
        still: Their difference, if the room keeps its position in the older image.
    """
    there = None
    if still is None:
        there = _background_positions(ego.B, pair.now.shape)
        still = image_difference(pair, there)
    threshold = max(LEAST_FLOW_PX / shrink, _NOISE_FACTOR * ego.noise_px)
    if not by_image:
        threshold += _PARALLAX_SHARE * ego.shift_px
    shape = pair.now.shape
    change = np.zeros(shape, np.float32)
    flow = np.zeros((*shape, 2), np.float32)
    things = MotionMask(flow, np.zeros(shape, np.bool_), threshold, change)
    window = pair.window
    part = pair.crop(window)
    if part.now.size == 0:
        return things
    corner = np.array((window[1].start, window[0].start), np.float32)
    at = None if there is None else there[window] - corner
    rest = -part.flow if at is None else at - _add_flow(part.flow, 1.0)
    moves = rest
    if by_image and ego.shift_px > _STANDS_PX:
        moves = rest - _parallax_part(rest, ego, _PARALLAX_SHARE)
    mask = cv2.magnitude(moves[..., 0], moves[..., 1]) > threshold
    mask &= part.valid_mask
    squares = still.mean_squares[window]
    mask &= squares > _NOISE_RATIO * still.noise
    if mask.any():
        mask &= _cross_edge_mask(part.now, moves, threshold)
        # The flow must explain a pixel, and the camera's motion must not. Background that a
        # thing has uncovered changed too, and any flow explains plain background. But its flow
        # begins at unchanged pixels, the flow of a thing at pixels that it has left.
        moving = _mean_squares(part.now, part.before, _add_flow(part.flow, 1.0))
        left = cv2.remap(squares, _add_flow(rest, -1.0), _ONE_MAP, cv2.INTER_LINEAR, None, _EDGE)
        mask &= left > _NOISE_RATIO * still.noise
        mask &= moving < _LEFT_SHARE * (squares - still.noise) + still.noise
    things.flow[window], things.mask[window] = rest, mask
    if mask.any():
        change[window] = _object_change(part, at)
    return things


def _object_change(pair: ImagePair, there: Flow | None) -> Plane:
    """Return the square of the relative change of brightness, without light, (h, w).

    A shadow darkens neighbouring pixels equally; a thing has its own edges.
    """
    seen = _warp_older(pair.before, there)
    change: Plane = np.log((pair.now + _DARK) / (seen + _DARK)).astype(np.float32)
    change -= cv2.blur(change, (_NEAR_PX, _NEAR_PX))
    return np.asarray(change * change, np.float32)


def _cross_edge_mask(now: Grey, moves: Flow, threshold_px: float) -> Mask:
    """Return a mask of motion across edges: along a straight edge no motion is visible.

    Compression shifts the weak texture along an edge back and forth.
    """
    gx, gy = gradients(now)
    window = _NEAR_PX, _NEAR_PX
    change = gx * moves[..., 0] + gy * moves[..., 1]
    shown = cv2.blur(change * change, window)
    most = cv2.blur(gx * gx + gy * gy, window)
    way = cv2.blur(_dot(moves, moves), window)
    least = np.maximum(np.float32(0.25 * threshold_px**2), np.float32(_ACROSS**2) * way)
    out: Mask = shown > least * most
    return out


def _parallax_part(rest: Flow, ego: EgoMotion, most: float) -> Flow:
    """Return the part of a motion that a still thing nearer than the room could have, (h, w, 2).

    A lens that turns also moves sideways, so near things move like the room but farther, and things
    behind it a little less.

    Args:
        rest: Motion (h, w, 2) in addition to the room's.
        ego: The camera's own motion.
        most: Largest additional motion of a thing, as a share of the room's motion.
    """
    room = -_background_positions(np.asarray(np.linalg.inv(ego.total)), rest.shape[:2])
    room = _add_flow(room, 1.0)
    squares = np.maximum(_dot(room, room), np.float32(1e-6))
    along = np.asarray(_dot(rest, room) / squares, dtype=np.float32)
    out: Flow = np.clip(along, -_BEHIND, most)[..., None] * room
    return out


def _dot(a: Flow, b: Flow) -> Plane:
    """Return the scalar products of two flows, (h, w).

    Over an axis of length two, ``sum`` takes several times as long as one addition.
    """
    out: Plane = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]
    return out


def _background_positions(B: Floats, shape: tuple[int, ...]) -> Flow:
    """Return the positions of the still room's pixels in the older image, (h, w, 2)."""
    height, width = shape
    x, y = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)[:, None]
    (a, b, c), (d, e, f), (g, h, i) = B.astype(np.float32)
    depth = np.maximum(g * x + h * y + i, np.float32(1e-3))
    return np.dstack(((a * x + b * y + c) / depth, (d * x + e * y + f) / depth))


def _add_flow(flow: Flow, sign: float) -> Flow:
    """Return each pixel's position plus or minus its flow."""
    out: Flow = np.float32(sign) * flow
    out[..., 0] += np.arange(out.shape[1], dtype=np.float32)
    out[..., 1] += np.arange(out.shape[0], dtype=np.float32)[:, None]
    return out


def _mean_squares(now: Grey, before: Grey, there: Flow | None) -> Plane:
    """Return the local mean square difference from the older image, seen through a map."""
    off = remove_illumination(now.astype(np.float32) - _warp_older(before, there))
    return np.asarray(cv2.blur(off * off, (_WINDOW_PX, _WINDOW_PX)), dtype=np.float32)


def _warp_older(before: Grey, there: Flow | None) -> Plane:
    """Return the older image seen through a map; unchanged for None."""
    grey = before.astype(np.float32)
    if there is None:
        return grey
    return np.asarray(cv2.remap(grey, there, _ONE_MAP, cv2.INTER_LINEAR, None, _EDGE), np.float32)

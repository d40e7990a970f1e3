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
    DARK,
    Floats,
    Flow,
    Grey,
    ImagePair,
    Mask,
    Plane,
    add_grid,
    pixel_grid,
    remove_illumination,
)

# Smallest displacement that counts as motion, pixels.
_LEAST_FLOW_PX = 0.125
# Ratio to the noise of the flow on the still background that motion must exceed.
_NOISE_FACTOR = 5.0
# Threshold as a share of the camera's own motion: still things nearer than the background move
# relative to it when the head turns.
_PARALLAX_SHARE = 0.1
# Window in which brightness is compared: wide enough to average noise, narrow enough for a hand.
_WINDOW_PX = 3
# Window within which a change of light is equal.
_NEAR_PX = 5
# Largest residual of the flow, as a share of the change that the camera does not explain.
_LEFT_SHARE = 0.5
# Smallest ratio of a change to the noise (variances), and a grey level for rounding.
_NOISE_RATIO, _ROUNDING = 3.0, 1.0
# Share by which a static object behind most of the room moves less in the picture than the room.
_BEHIND = 0.03
# A camera that moved the image by less is at rest.
_STANDS_PX = 0.01
# Size of an image of cells relative to the image.
_CELL = 0.25
_ONE_MAP: Plane = np.empty(0, dtype=np.float32)


class MotionMask(NamedTuple):
    """Independent motion in an image.

    flow: (h, w, 2) motion from the older image to the newer, without the camera's, pixels
    mask: (h, w) pixels with confirmed motion
    change: (h, w) square of the relative change of brightness, without light
    """

    flow: Flow
    mask: Mask
    change: Plane


def segment_motion(pair: ImagePair, ego: EgoMotion, by_image: bool = False) -> MotionMask:
    """Return the flow without ego-motion, masked by confirmation from both frames.

    Args:
        pair: The two images and their flow.
        ego: The camera's own motion.
        by_image: Whether only the image shows that motion. In that case any motion that a still,
            nearer thing cannot have (against the room or across its motion) counts.
    """
    there, at = _background_positions(ego.B, pair.now.shape), add_grid(pair.flow)
    threshold = max(_LEAST_FLOW_PX, _NOISE_FACTOR * ego.noise_px)
    rest = there - at
    moves = rest
    if by_image and ego.shift_px > _STANDS_PX:
        moves = rest - _parallax_part(rest, ego)
    elif not by_image:
        threshold += _PARALLAX_SHARE * ego.shift_px
    squares = _mean_squares(pair, there)
    noise = _noise(squares)
    mask = cv2.magnitude(moves[..., 0], moves[..., 1]) > threshold
    mask &= pair.valid_mask & (squares > _NOISE_RATIO * noise)
    # The flow must explain a pixel, and the camera's motion must not. Background that a thing has
    # uncovered changed too, and any flow explains plain background. But its flow begins at
    # unchanged pixels, the flow of a thing at pixels that it has left.
    mask &= _warp(squares, add_grid(-rest)) > _NOISE_RATIO * noise
    mask &= _mean_squares(pair, at) < _LEFT_SHARE * (squares - noise) + noise
    return MotionMask(rest, mask, _object_change(pair, there))


def is_unchanged(pair: ImagePair) -> bool:
    """Return whether two aligned images differ by noise alone."""
    squares = _mean_squares(pair, pixel_grid(pair.now.shape))
    changed = (squares > _NOISE_RATIO * _noise(squares)).astype(np.uint8)
    # A cell is 0 unless half of its pixels changed.
    cells = cv2.resize(changed, None, fx=_CELL, fy=_CELL, interpolation=cv2.INTER_AREA)
    return not cells.any()


def _noise(squares: Plane) -> float:
    return _ROUNDING + float(np.quantile(squares[::4, ::4], 0.3))


def _object_change(pair: ImagePair, there: Flow) -> Plane:
    """Return the square of the relative change of brightness, without light, (h, w).

    A shadow darkens neighbouring pixels equally; a thing has its own edges.
    """
    change = np.log((pair.now + DARK) / (_warp(pair.before, there) + DARK))
    change -= cv2.blur(change, (_NEAR_PX, _NEAR_PX))
    return np.asarray(change * change, np.float32)


def _parallax_part(rest: Flow, ego: EgoMotion) -> Flow:
    """Return the part of a motion that a still thing nearer than the room could have, (h, w, 2).

    A lens that turns also moves sideways, so near things move like the room but farther, and things
    behind it a little less.

    Args:
        rest: Motion (h, w, 2) in addition to the room's.
        ego: The camera's own motion.
    """
    past = np.asarray(np.linalg.inv(ego.total), np.float64)
    room: Flow = pixel_grid(rest.shape) - _background_positions(past, rest.shape)
    (u, v), (x, y) = cv2.split(rest), cv2.split(room)
    along = (u * x + v * y) / np.maximum(x * x + y * y, np.float32(1e-6))
    return np.asarray(np.clip(along, -_BEHIND, _PARALLAX_SHARE)[..., None] * room, np.float32)


def _background_positions(B: Floats, shape: tuple[int, ...]) -> Flow:
    """Return the positions of the still room's pixels in the older image, (h, w, 2)."""
    return np.asarray(cv2.perspectiveTransform(pixel_grid(shape), B), np.float32)


def _mean_squares(pair: ImagePair, there: Flow) -> Plane:
    """Return the local mean square difference from the older image, seen through a map."""
    off = remove_illumination(pair.now.astype(np.float32) - _warp(pair.before, there))
    return np.asarray(cv2.blur(off * off, (_WINDOW_PX, _WINDOW_PX)), dtype=np.float32)


def _warp(image: Grey | Plane, there: Flow) -> Plane:
    linear, edge = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
    seen = cv2.remap(image.astype(np.float32), there, _ONE_MAP, linear, None, edge)
    return np.asarray(seen, np.float32)

"""Which pixels move on their own: what is left of the flow, where the images bear it out.

Flow is found everywhere, in plain walls too, where it means nothing. A pixel counts when
its flow differs from the camera's, when the camera's own motion does not explain the newer
image there, and when the flow does. Light that flickers, shadows' edges apart, changes the
image and is no better explained by any flow.
"""

from typing import NamedTuple

import cv2
import numpy as np

from gazerig.drivers.vision.motion.ego_motion import Ego
from gazerig.drivers.vision.motion.image import Floats, Grey, Plane, light_apart
from gazerig.drivers.vision.motion.optical_flow import Compared, Flow, Mask, gradients
from gazerig.drivers.vision.motion.params import MotionParams

# Where brightness is compared: wide enough to average noise, narrow enough for a hand.
_WINDOW_PX = 3
# Where edges and light are.
_NEAR_PX = 5
# Of the change that the camera does not explain, what the flow may leave.
_LEFT_SHARE = 0.5
# How far above the noise a change must be (variances), and a grey level for rounding.
_NOISE_RATIO, _ROUNDING = 3.0, 1.0
# How much less far than the room a still thing moves that is behind most of it, as a share.
_BEHIND = 0.03
# Of a motion, the share that must lead across the edges there.
_ACROSS = 0.15
# How far flow smears over an edge.
_SMEAR_PX = 9
# Grey levels: darker than this, relative changes are noise.
_DARK = np.float32(8.0)
# A camera that moved the image by less stands.
_STANDS_PX = 0.01
_ONE_MAP: Plane = np.empty(0, dtype=np.float32)
_EDGE = cv2.BORDER_REPLICATE


class Things(NamedTuple):
    """What moves on its own.

    flow: (h, w, 2) motion from the older image to the newer, the camera's taken out, pixels
    mask: (h, w) where that is believed
    threshold_px: least motion that was believed
    change: (h, w) square of the relative change of brightness, light apart; None: not asked
    """

    flow: Flow
    mask: Mask
    threshold_px: float
    change: Plane | None = None


class Unlike(NamedTuple):
    """How unlike the older image is where the room stands still.

    squares: (h, w) local mean of squares, grey levels
    noise: what is usual of them
    """

    squares: Plane
    noise: float

    @property
    def changed(self) -> Mask:
        """Return where more has changed than by noise."""
        return self.squares > _NOISE_RATIO * self.noise


def unlike(pair: Compared, there: Flow | None = None) -> Unlike:
    """Compare two images.

    Args:
        pair: the images.
        there: (h, w, 2) where still things are in the older one; None: at their place.
    """
    squares = _squares(pair.now, pair.before, there)
    return Unlike(squares, _ROUNDING + float(np.quantile(squares[::4, ::4], 0.3)))


def what_moves(
    pair: Compared,
    ego: Ego,
    params: MotionParams,
    by_image: bool = False,
    still: Unlike | None = None,
) -> Things:
    """Return the flow without ego-motion, where both frames confirm it.

    Args:
        pair: the two images and their flow.
        ego: the camera's own motion.
        params: thresholds.
        by_image: the image alone told that motion. What moves otherwise than a still thing nearer
            than the room would, against the room or across its motion, then counts from the
            least motion on.
        still: how unlike they are, where the room keeps its place in the older image.
    """
    there = None if still is not None and pair.shift is None else _there(pair, ego)
    if still is None or pair.shift is not None:
        still = unlike(pair, there)
    threshold = max(params.min_flow_px, params.noise_factor * ego.noise_px)
    if not by_image:
        threshold += params.parallax_share * ego.way_px
    shape = pair.now.shape
    change = np.zeros(shape, np.float32)
    flow = np.zeros((*shape, 2), np.float32)
    things = Things(flow, np.zeros(shape, np.bool_), threshold, change)
    for window in pair.windows:
        part = pair.part(window)
        corner = np.array((window[1].start, window[0].start), np.float32)
        at = None if there is None else there[window] - corner
        rest = -part.flow if at is None else at - _added(part.flow, 1.0)
        moves = rest
        if by_image and ego.way_px > _STANDS_PX:
            moves = rest - _nearer(rest, ego, params.parallax_share)
        mask = cv2.magnitude(moves[..., 0], moves[..., 1]) > threshold + _jumps(part.shift)
        mask &= part.known
        squares = still.squares[window]
        mask &= squares > _NOISE_RATIO * still.noise
        if mask.any():
            mask &= _across(part.now, moves, threshold)
            mask &= _borne_out(part, squares, still.noise, rest)
        things.flow[window], things.mask[window] = rest, mask
        if mask.any():
            change[window] = _solid(part, at)
    return things


def _there(pair: Compared, ego: Ego) -> Flow:
    """Return where still things are in the older image, (h, w, 2)."""
    there = _background(ego.B, pair.now.shape)
    if pair.shift is not None:
        there += pair.shift
    return there


def _solid(pair: Compared, there: Flow | None) -> Plane:
    """Return the square of the relative change of brightness, light apart, (h, w).

    A shadow darkens alike all that lies near each other; a thing brings its own edges.
    """
    seen = _through(pair.before, there)
    change: Plane = np.log((pair.now + _DARK) / (seen + _DARK)).astype(np.float32)
    change -= cv2.blur(change, (_NEAR_PX, _NEAR_PX))
    return np.asarray(change * change, np.float32)


def _across(now: Grey, moves: Flow, threshold_px: float) -> Mask:
    """Return where things move across their edges: along a straight edge no motion shows.

    Compression shifts what little texture there is along an edge to and fro.
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


def _jumps(shift: Flow | None) -> Plane | float:
    """Return by how much still neighbours part, (h, w): flow there may be the other's."""
    if shift is None:
        return 0.0
    ends = cv2.morphologyEx(shift, cv2.MORPH_GRADIENT, np.ones((_SMEAR_PX, _SMEAR_PX), np.uint8))
    return np.asarray(ends[..., 0] + ends[..., 1], dtype=np.float32)


def _nearer(rest: Flow, ego: Ego, most: float) -> Flow:
    """Return how much of a motion could be that of a still thing nearer than the room, (h, w, 2).

    A lens that turns also moves aside, so that what is near moves along with the room and farther,
    and what is behind it a little less far.

    Args:
        rest: (h, w, 2) motion besides the room's.
        ego: the camera's own motion.
        most: how much farther a thing may move, as a share of the room's motion.
    """
    room = -_background(np.asarray(np.linalg.inv(ego.total)), rest.shape[:2])
    room = _added(room, 1.0)
    squares = np.maximum(_dot(room, room), np.float32(1e-6))
    along = np.asarray(_dot(rest, room) / squares, dtype=np.float32)
    out: Flow = np.clip(along, -_BEHIND, most)[..., None] * room
    return out


def _dot(a: Flow, b: Flow) -> Plane:
    """Return the scalar products of two flows, (h, w).

    Over an axis of two, ``sum`` takes several times as long as one addition.
    """
    out: Plane = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]
    return out


def _background(B: Floats, shape: tuple[int, ...]) -> Flow:
    """Return where the still room's pixels lie in the older image, (h, w, 2).

    Args:
        B: (3, 3) pixels of the newer image to those of the older.
        shape: of the images.
    """
    height, width = shape
    x, y = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)[:, None]
    (a, b, c), (d, e, f), (g, h, i) = B.astype(np.float32)
    depth = np.maximum(g * x + h * y + i, np.float32(1e-3))
    return np.dstack(((a * x + b * y + c) / depth, (d * x + e * y + f) / depth))


def _borne_out(pair: Compared, still: Plane, noise: float, rest: Flow) -> Mask:
    """Return where the flow explains the newer image and the camera's motion does not.

    Ground that a thing has left changed too, and plain ground is explained by any flow; but
    it "came" from where nothing has changed, while a thing has left where it came from.
    """
    moving = _squares(pair.now, pair.before, _added(pair.flow, 1.0))
    left = cv2.remap(still, _added(rest, -1.0), _ONE_MAP, cv2.INTER_LINEAR, None, _EDGE)
    out: Mask = left > _NOISE_RATIO * noise
    out &= moving < _LEFT_SHARE * (still - noise) + noise
    return out


def _added(flow: Flow, sign: float) -> Flow:
    """Return each pixel's own place with its flow added, or taken away."""
    out: Flow = np.float32(sign) * flow
    out[..., 0] += np.arange(out.shape[1], dtype=np.float32)
    out[..., 1] += np.arange(out.shape[0], dtype=np.float32)[:, None]
    return out


def _squares(now: Grey, before: Grey, there: Flow | None) -> Plane:
    """Return how unlike the older image is, seen through a map: a local mean of squares."""
    off = light_apart(now.astype(np.float32) - _through(before, there))
    return np.asarray(cv2.blur(off * off, (_WINDOW_PX, _WINDOW_PX)), dtype=np.float32)


def _through(before: Grey, there: Flow | None) -> Plane:
    """Return the older image seen through a map; None: as it is."""
    grey = before.astype(np.float32)
    if there is None:
        return grey
    return np.asarray(cv2.remap(grey, there, _ONE_MAP, cv2.INTER_LINEAR, None, _EDGE), np.float32)

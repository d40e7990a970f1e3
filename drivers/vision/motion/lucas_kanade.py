"""The affine motion of a patch, refined on the brightness of its own pixels.

Flow is found from patches that reach over a thing's edge, where they mix its motion with
the ground's; of a small thing that is most of it. Here one affine map is fitted to all its
pixels at once (inverse compositional alignment, Baker and Matthews 2004), with Tukey's
weights, so that pixels of the ground drop out, first on blurred and then on sharp images.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.vision.motion.image import Floats, Grey, Plane, middle
from gazerig.drivers.vision.motion.optical_flow import moved

# (blur in pixels, most steps): what is off by more than the blur is not found.
_LEVELS = ((2.5, 8), (1.0, 6))
_TUKEY = 4.685
_LEAST_POINTS = 24
# Grey levels: what pixels are off by at best.
_LEAST_NOISE = 1.0
# A step that moves no pixel by more is the last.
_SMALL_PX = 0.02
# Spread of what flow is off by: its slide (pixels) and, a patch's radius away, its slopes.
_SLIDE_SD_PX, _SLOPE_SD_PX = 2.0, 3.0
# Neighbouring pixels of blurred images say the same: so many are one measurement.
_ALIKE = 12.0
# Weak beliefs in the start; brightness may differ as it likes.
_BELIEF = np.diag([_SLOPE_SD_PX**-2.0] * 4 + [_SLIDE_SD_PX**-2.0] * 2 + [1e-9])
_ONE_MAP: Plane = np.empty(0, dtype=np.float32)
_EDGE = cv2.BORDER_REPLICATE


class Back(NamedTuple):
    """An affine map of places now to places in the older image, the camera's motion taken out.

    matrix: (2, 2); shift: (2,): x -> centre + matrix (x - centre) + shift
    slope_sd: standard deviation of the matrix's numbers, root mean square
    """

    matrix: Floats
    shift: Floats
    slope_sd: float


class Blurred(NamedTuple):
    """Two images, blurred once for all patches: pairs (now, before), coarse first."""

    pairs: tuple[tuple[Plane, Plane], ...]


def blurred(now: Grey, before: Grey) -> Blurred:
    """Blur both images at every level."""
    return Blurred(tuple((_blur(now, sigma), _blur(before, sigma)) for sigma, _ in _LEVELS))


class Room(NamedTuple):
    """Where still things are in the older image.

    B: (3, 3) pixels now to pixels there; shift: (2,) besides, at the distance of the patch
    """

    B: Floats
    shift: Floats


def refined(start: Back, places: Floats, centre: Floats, frames: Blurred, room: Room) -> Back:
    """Refine a map on the pixels at ``places``, (n, 2); the start itself where that fails."""
    arms = places - centre
    size = max(1.0, float(np.sqrt((arms**2).sum(axis=1).mean())))
    if len(places) < _LEAST_POINTS:
        return start
    best = start
    for (now, before), (_, steps) in zip(frames.pairs, _LEVELS, strict=True):
        fit = _aligned(best, arms, centre, size, now, before, room, steps)
        if fit is None:
            return best
        best = fit
    return best


def _aligned(
    start: Back,
    arms: Floats,
    centre: Floats,
    size: float,
    now: Plane,
    before: Plane,
    room: Room,
    steps: int,
) -> Back | None:
    """Refine at one level; None where it leads away or to nothing better."""
    wanted, slopes = _template(now, (arms + centre).astype(np.intp), arms / size)
    matrix, shift = start.matrix, start.shift
    errors = wanted - _seen(before, room, centre + arms @ matrix.T + shift)
    first, weights = _weighed(errors)
    noise, normal = first, np.eye(7)
    for _ in range(steps):
        weighted = slopes * weights[:, None]
        normal = slopes.T @ weighted + noise**2 * _BELIEF
        step = np.linalg.solve(normal, weighted.T @ errors)
        change = np.eye(2) + step[:4].reshape(2, 2) / size
        matrix = matrix @ change
        shift = shift + matrix @ step[4:6]
        errors = wanted - _seen(before, room, centre + arms @ matrix.T + shift)
        noise, weights = _weighed(errors)
        if np.abs(step[:6]).max() < _SMALL_PX:
            break
    led_away = np.abs(matrix - start.matrix).max() * size > 3 * _SLOPE_SD_PX
    led_away |= bool(np.abs(shift - start.shift).max() > 3 * _SLIDE_SD_PX)
    if led_away or noise > first or not np.isfinite(matrix).all():
        return None
    spread = noise * np.sqrt(_ALIKE * np.linalg.inv(normal).diagonal()[:4].mean()) / size
    return Back(matrix, shift, float(spread))


def _template(now: Plane, at: NDArray[np.intp], arms: Floats) -> tuple[Floats, Floats]:
    """Return brightness (n,), and (n, 7) how it changes with the map's numbers and with light."""
    height, width = now.shape
    x, y = at.T
    right, left = np.minimum(x + 1, width - 1), np.maximum(x - 1, 0)
    below, above = np.minimum(y + 1, height - 1), np.maximum(y - 1, 0)
    gx = 0.5 * (now[y, right] - now[y, left]).astype(np.float64)
    gy = 0.5 * (now[below, x] - now[above, x]).astype(np.float64)
    u, v = arms.T
    slopes = np.column_stack((gx * u, gx * v, gy * u, gy * v, gx, gy, np.ones(len(x))))
    return now[y, x].astype(np.float64), slopes


def _seen(before: Plane, room: Room, places: Floats) -> Floats:
    """Return the older image's brightness at places of the newer, (n,)."""
    there = (moved(room.B, places) + room.shift).astype(np.float32)
    seen = cv2.remap(before, there[:, None], _ONE_MAP, cv2.INTER_LINEAR, None, _EDGE)
    return np.asarray(seen, dtype=np.float64).ravel()


def _weighed(errors: Floats) -> tuple[float, Floats]:
    """Return the noise of errors, the mean apart, and Tukey's weights."""
    apart = np.abs(errors - middle(errors))
    noise = max(_LEAST_NOISE, 1.4826 * middle(apart))
    return noise, np.maximum(1.0 - (apart / (_TUKEY * noise)) ** 2, 0.0) ** 2


def _blur(grey: Grey, sigma: float) -> Plane:
    return np.asarray(cv2.GaussianBlur(grey.astype(np.float32), (0, 0), sigma), dtype=np.float32)

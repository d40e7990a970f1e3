"""Effects of lens, exposure and sensor on an ideal picture.

A ``SceneView`` draws the picture of an ideal pinhole at an instant; this module bends it, blurs it
by the camera's turn, and adds noise.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, hypot
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3
from gazerig.params import Bounds
from gazerig.robot.model.intrinsics import rays
from gazerig.robot.model.scene_view import PinholeView, Rendered, SceneView

# Fresh noise would cost more than the drawing; slices of one stock look the same.
_NOISE_STOCK = 1 << 21
# Stereo measures nothing next to edges: width in pixels, and share of the jump in distance.
_BLIND_PX, _JUMP = 5, 0.08
_BORDER_PX = 1.0
_MOST_PIXELS = 4.0  # of an ideal picture, as a multiple of the visible part


@dataclass(frozen=True)
class SensorParams:
    """Fidelity of the picture to the light."""

    # fmt: off
    noise_grey: Annotated[float, Bounds(0, 60), "standard deviation of the read-out noise, grey values"] = 3.0
    depth_noise_1_m: Annotated[float, Bounds(0, 0.2), "error of a measured distance at 1 m, metres; it grows with its square"] = 0.004
    exposure_ms: Annotated[float, Bounds(0, 100), "exposure time"] = 8.0
    # fmt: on


class Sensor:
    """Adds noise to pictures and distances."""

    def __init__(self, params: SensorParams, rng: np.random.Generator) -> None:
        self._params, self._rng = params, rng
        self._stock = rng.standard_normal(_NOISE_STOCK, dtype=np.float32)

    def image(self, light: ImageArray) -> ImageArray:
        """Return the picture that the sensor reads for given light."""
        noise_grey = self._params.noise_grey
        if noise_grey <= 0.0:
            return light
        noise = self._noise(light.shape) * np.float32(noise_grey)
        out: ImageArray = cv2.add(light, noise, dtype=cv2.CV_8U).astype(np.uint8, copy=False)
        return out

    def stereo(self, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return distances as stereo measures them: quadratic error, blind next to edges."""
        noise = self._noise(depth_m.shape) * np.float32(self._params.depth_noise_1_m)
        seen = depth_m * (1.0 + depth_m * noise)
        kernel = np.ones((_BLIND_PX, _BLIND_PX), np.uint8)
        step = cv2.dilate(depth_m, kernel) - cv2.erode(depth_m, kernel)
        blind = ~(step < _JUMP * depth_m)
        out: NDArray[np.float32] = np.where(blind, np.float32(np.nan), seen).astype(np.float32)
        return out

    def _noise(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Return a piece of the prepared noise, different in each call."""
        size = int(np.prod(shape))
        start = int(self._rng.integers(0, _NOISE_STOCK))
        piece = self._stock[start : start + size]
        if len(piece) < size:
            piece = np.take(self._stock, np.arange(start, start + size), mode="wrap")
        return piece.reshape(shape)


def smear_px(R: Mat3, R_before: Mat3, share: float, lens: Intrinsics) -> tuple[float, float]:
    """Return how far the centre of the frame moves during an exposure.

    Args:
        R: the camera's rotation in the world, optical axes.
        R_before: the rotation before.
        share: exposure time, as a multiple of the time between the rotations.
        lens: its lens.
    """
    x, y, z = (np.array(R_before).T @ np.array(R)[:, 2]).tolist()
    return -x / z * lens.fx_px * share, -y / z * lens.fy_px * share


def through_lens(view: SceneView, seen_by: PinholeView, *, depth: bool = False) -> Rendered:
    """Return the view through a lens that may distort; see ``SceneView.draw``."""
    lens, size_px = seen_by.lens, seen_by.size_px
    if not lens.has_distortion:
        return view.draw(seen_by, depth=depth)
    ideal, ideal_px, columns, lines = _ideal_lens_and_map(lens, size_px)
    drawn = view.draw(seen_by._replace(lens=ideal, size_px=ideal_px), depth=depth)
    edge = cv2.BORDER_REPLICATE
    bent = cv2.remap(drawn.image, columns, lines, cv2.INTER_LINEAR, borderMode=edge)
    image = bent.astype(np.uint8, copy=False)
    if drawn.depth_m is None:
        return Rendered(image, None)
    # Distances are not interpolated: a mean of two objects' distances is at neither.
    metres = cv2.remap(drawn.depth_m, columns, lines, cv2.INTER_NEAREST, borderMode=edge)
    return Rendered(image, metres.astype(np.float32, copy=False))


@lru_cache(maxsize=8)
def _ideal_lens_and_map(
    lens: Intrinsics, size_px: tuple[int, int]
) -> tuple[Intrinsics, tuple[int, int], NDArray[np.float32], NDArray[np.float32]]:
    """Return an ideal lens and picture size that cover a lens's field, and the pixel map.

    The two arrays (h, w) are column and row in the ideal picture of every pixel.
    """
    width, height = size_px
    rows, columns = np.mgrid[0:height, 0:width]
    pixels = np.stack((columns.ravel(), rows.ravel()), axis=1)
    plane = rays(pixels, lens)[:, :2] * (lens.fx_px, lens.fy_px)
    low, high = plane.min(axis=0) - _BORDER_PX, plane.max(axis=0) + _BORDER_PX
    span = high - low
    share = min(1.0, (_MOST_PIXELS * width * height / float(span[0] * span[1])) ** 0.5)
    cx, cy = (-low * share).tolist()
    ideal = Intrinsics(lens.fx_px * share, lens.fy_px * share, cx, cy)
    ideal_px = ceil(float(span[0]) * share), ceil(float(span[1]) * share)
    places = ((plane - low) * share).astype(np.float32).reshape(height, width, 2)
    return ideal, ideal_px, places[..., 0].copy(), places[..., 1].copy()


def blur_along(image: ImageArray, way_px: tuple[float, float]) -> ImageArray:
    """Blur a frame evenly along a displacement (x, y) in pixels."""
    length = hypot(*way_px)
    if length < 1.0:
        return image
    half = int(np.ceil(0.5 * length))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    # Samples spread evenly over the displacement, each shared among the four pixels around it.
    for share in np.linspace(-0.5, 0.5, 4 * half + 1).tolist():
        x, y = half + share * way_px[0], half + share * way_px[1]
        i, j = min(int(x), 2 * half - 1), min(int(y), 2 * half - 1)
        u, v = x - i, y - j
        kernel[j : j + 2, i : i + 2] += np.outer((1.0 - v, v), (1.0 - u, u))
    out: ImageArray = cv2.filter2D(
        image, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REPLICATE
    ).astype(np.uint8, copy=False)
    return out

"""Effects of lens, exposure, read-out and sensor on an ideal picture.

A ``SceneView`` draws the picture of an ideal pinhole at an instant. A real lens bends straight
lines, the exposure takes time, and most sensors read row after row while the head turns. This
module draws more than once, or a larger picture, to add these effects to any view.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, hypot
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.intrinsics import rays
from gazerig.robot.model.scene_view import PinholeView, Rendered, SceneView

# Fresh noise would cost more than the drawing; slices of one stock look the same.
_NOISE_STOCK = 1 << 21
# Stereo measures nothing next to edges: width in pixels, and share of the jump in distance.
_BLIND_PX, _JUMP = 5, 0.08


@dataclass(frozen=True)
class SensorParams:
    """Fidelity of the picture to the light."""

    # fmt: off
    noise_grey: Annotated[float, Bounds(0, 60), "standard deviation of the read-out noise, grey values"] = 3.0
    shot_noise_grey: Annotated[float, Bounds(0, 60),
        "standard deviation of the photon noise of a white pixel; it grows with the square root of the light"] = 0.0
    gain: Annotated[float, Bounds(0.05, 20), "brightness factor; values above white are over-exposed"] = 1.0
    gamma: Annotated[float, Bounds(0.2, 5), "exponent of grey values between 0 and 1; above 1: darker mid-tones"] = 1.0
    depth_noise_1_m: Annotated[float, Bounds(0, 0.2), "error of a measured distance at 1 m, metres; it grows with its square"] = 0.004
    # fmt: on


class Sensor:
    """Adds noise to pictures and distances."""

    def __init__(self, params: SensorParams, rng: np.random.Generator) -> None:
        self._params, self._rng = params, rng
        self._unit = params.noise_grey or 1.0
        self._stock = rng.standard_normal(_NOISE_STOCK, dtype=np.float32) * self._unit
        grey = np.arange(256)
        light = params.gain * (grey / 255.0) ** params.gamma
        self._tone = np.clip(np.rint(255.0 * light), 0, 255).astype(np.uint8)
        self._has_tone = bool((self._tone != grey).any())
        shot = params.shot_noise_grey * np.sqrt(grey / 255.0)
        # In multiples of the deviation of the stock.
        self._deviation = (np.hypot(params.noise_grey, shot) / self._unit).astype(np.float32)

    def image(self, light: ImageArray) -> ImageArray:
        """Return the picture that the sensor reads for given light."""
        params = self._params
        image = self._tone[light] if self._has_tone else light
        if params.noise_grey <= 0.0 and params.shot_noise_grey <= 0.0:
            return image
        noise = self._noise_piece(image.size).reshape(image.shape)
        if params.shot_noise_grey > 0.0:
            noise = noise * self._deviation[image]
        out: ImageArray = cv2.add(image, noise, dtype=cv2.CV_8U).astype(np.uint8, copy=False)
        return out

    def stereo(self, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return distances as stereo measures them: quadratic error, blind next to edges."""
        noise = self._noise_piece(depth_m.size).reshape(depth_m.shape)
        noise = noise * (self._params.depth_noise_1_m / self._unit)
        seen = depth_m * (1.0 + depth_m * noise)
        kernel = np.ones((_BLIND_PX, _BLIND_PX), np.uint8)
        step = cv2.dilate(depth_m, kernel) - cv2.erode(depth_m, kernel)
        blind = ~(step < _JUMP * depth_m)
        out: NDArray[np.float32] = np.where(blind, np.float32(np.nan), seen).astype(np.float32)
        return out

    def _noise_piece(self, size: int) -> NDArray[np.float32]:
        """Return a slice of the prepared noise, different in each call."""
        start = int(self._rng.integers(0, _NOISE_STOCK))
        piece = self._stock[start : start + size]
        if len(piece) == size:
            return piece
        return np.take(self._stock, np.arange(start, start + size), mode="wrap")


_BORDER_PX = 1.0
_MOST_PIXELS = 4.0  # of an ideal picture, as a multiple of the visible part


@dataclass(frozen=True)
class OpticsParams:
    """Exposure, read-out and sharpness."""

    # fmt: off
    exposure_ms: Annotated[float, Bounds(0, 100), "exposure time"] = 8.0
    sub_exposures: Annotated[int, Bounds(1, 32),
        "number of pictures averaged over the exposure; 1: one picture, blurred only by the camera's turn"] = 1
    read_out_ms: Annotated[float, Bounds(0, 100),
        "time from the first row to the last (rolling shutter); 0: all rows at the same time"] = 0.0
    blur_px: Annotated[float, Bounds(0, 10),
        "blur of the lens: standard deviation in pixels; it also softens jagged edges"] = 0.0
    bands: Annotated[int, Bounds(2, 64), "number of row bands that are drawn separately for a rolling shutter"] = 8
    # fmt: on


class CameraMotion(NamedTuple):
    """A camera's pose at an instant, and its pose before.

    R, R_before: rotation in the world, optical axes
    span_s: time between them, 0 if the pose before is unknown
    """

    R: Mat3
    p_m: Vec3
    R_before: Mat3
    p_before_m: Vec3
    span_s: float

    def pose(self, after_s: float) -> tuple[Mat3, Vec3]:
        """Return rotation and position after a time (before, if negative) at constant velocity."""
        if after_s == 0.0 or self.span_s <= 0.0:
            return self.R, self.p_m
        share = after_s / self.span_s
        turn = cv2.Rodrigues(np.array(self.R) @ np.array(self.R_before).T)[0]
        turned = cv2.Rodrigues(turn * share)[0] @ np.array(self.R)
        place = np.array(self.p_m) + share * np.subtract(self.p_m, self.p_before_m)
        x, y, z = place.tolist()
        a, b, c = (tuple(row) for row in turned.tolist())
        return (a, b, c), (x, y, z)

    def smear_px(self, exposure_s: float, lens: Intrinsics) -> tuple[float, float]:
        """Return how far the centre of the frame moves during an exposure."""
        if self.span_s <= 0.0:
            return 0.0, 0.0
        ahead = np.array(self.R_before).T @ np.array(self.R)[:, 2]
        share = exposure_s / self.span_s
        return (
            float(-ahead[0] / ahead[2]) * lens.fx_px * share,
            float(-ahead[1] / ahead[2]) * lens.fy_px * share,
        )


def expose(
    view: SceneView,
    params: OpticsParams,
    t_s: float,
    lens: Intrinsics,
    size_px: tuple[int, int],
    motion: CameraMotion,
    *,
    depth: bool = False,
) -> Rendered:
    """Return a picture as a camera takes it; its time is the middle of its exposure.

    Args:
        view: draws the scene.
        params: exposure and read-out.
        t_s: time since the start of the scene, seconds.
        lens: lens of the camera, for pictures of this size, with its distortion.
        size_px: width and height.
        motion: pose and motion of the camera at that time.
        depth: whether to return distances, at the middle of each row's exposure.
    """
    bands = [
        _average_exposure(view, params, t_s, lens, size_px, motion, late_s, rows, depth)
        for late_s, rows in _row_bands(params, size_px[1])
    ]
    image = np.concatenate([band.image for band in bands]) if len(bands) > 1 else bands[0].image
    seen = [band.depth_m for band in bands if band.depth_m is not None]
    if params.sub_exposures == 1:
        image = blur_along(image, motion.smear_px(params.exposure_ms / 1e3, lens))
    if params.blur_px > 0.0:
        side = 2 * ceil(2.0 * params.blur_px) + 1 if params.blur_px > 0.8 else 3
        soft = cv2.GaussianBlur(image, (side, side), params.blur_px)
        image = soft.astype(np.uint8, copy=False)
    return Rendered(image, np.concatenate(seen) if seen else None)


def _row_bands(params: OpticsParams, height: int) -> Iterator[tuple[float, tuple[int, int] | None]]:
    """Yield the delay of each band of rows, and its rows; None: all."""
    if params.read_out_ms <= 0.0:
        yield 0.0, None
        return
    edges = [round(height * i / params.bands) for i in range(params.bands + 1)]
    for top, bottom in zip(edges, edges[1:], strict=False):
        if bottom > top:
            middle = 0.5 * (top + bottom) / height - 0.5
            yield middle * params.read_out_ms / 1e3, (top, bottom)


def _average_exposure(
    view: SceneView,
    params: OpticsParams,
    t_s: float,
    lens: Intrinsics,
    size_px: tuple[int, int],
    motion: CameraMotion,
    late_s: float,
    rows: tuple[int, int] | None,
    depth: bool,
) -> Rendered:
    """Return rows as the mean of the view during their exposure."""
    count, exposure_s = params.sub_exposures, params.exposure_ms / 1e3
    total: NDArray[np.float32] | None = None
    seen = None
    for i in range(count):
        after_s = late_s + exposure_s * ((i + 0.5) / count - 0.5)
        R, p_m = motion.pose(after_s)
        middle = depth and i == count // 2
        seen_by = PinholeView(t_s + after_s, lens, size_px, R, p_m)
        image, metres = through_lens(view, seen_by, depth=middle, rows=rows)
        if count == 1:
            return Rendered(image, metres)
        seen = metres if middle else seen
        total = np.zeros(image.shape, np.float32) if total is None else total
        cv2.accumulate(image, total)
    assert total is not None
    return Rendered(np.rint(total / count).astype(np.uint8), seen)


def through_lens(
    view: SceneView,
    seen_by: PinholeView,
    *,
    depth: bool = False,
    rows: tuple[int, int] | None = None,
) -> Rendered:
    """Return the view through a lens that may distort; see ``SceneView.draw``."""
    lens, size_px = seen_by.lens, seen_by.size_px
    if not lens.has_distortion:
        return view.draw(seen_by, depth=depth, rows=rows)
    ideal, ideal_px, columns, lines = _ideal_lens_and_map(lens, size_px)
    top, bottom = rows or (0, size_px[1])
    columns, lines = columns[top:bottom], lines[top:bottom]
    first = max(0, int(lines.min()) - 1) if rows else 0
    last = min(ideal_px[1], ceil(float(lines.max())) + 2) if rows else ideal_px[1]
    straight = seen_by._replace(lens=ideal, size_px=ideal_px)
    drawn = view.draw(straight, depth=depth, rows=(first, last))
    lines = lines - np.float32(first)
    edge = cv2.BORDER_REPLICATE
    bent = cv2.remap(drawn.image, columns, lines, cv2.INTER_LINEAR, borderMode=edge)
    image = bent.astype(np.uint8, copy=False)
    if drawn.depth_m is None:
        return Rendered(image, None)
    # Distances are not interpolated: a mean of two objects' distances is at neither.
    metres = cv2.remap(drawn.depth_m, columns, lines, cv2.INTER_NEAREST, borderMode=edge)
    return Rendered(image, metres.astype(np.float32, copy=False))


def ideal_size_px(lens: Intrinsics, size_px: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of the ideal picture that a picture through a lens needs."""
    return _ideal_lens_and_map(lens, size_px)[1] if lens.has_distortion else size_px


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

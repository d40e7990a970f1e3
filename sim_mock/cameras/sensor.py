"""Effects of a sensor on a picture: brightness, noise, and distances measured by stereo."""

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import ImageArray
from gazerig.params import Bounds

# Fresh noise would cost more than the drawing; slices of one stock look the same.
_NOISE_STOCK = 1 << 21
# Stereo measures nothing next to edges: width in pixels, and share of the jump in distance.
_BLIND_PX, _JUMP = 5, 0.08


@dataclass(frozen=True)
class SensorParams:
    """Fidelity of the picture to the light."""

    # fmt: off
    noise_grey: Annotated[float, Bounds(0, 60), "standard deviation of the noise of reading, grey values"] = 3.0
    shot_noise_grey: Annotated[float, Bounds(0, 60),
        "standard deviation of the noise of the light itself where a pixel is white; grows with the root of the light"] = 0.0
    gain: Annotated[float, Bounds(0.05, 20), "brightness as a multiple; what gets over white is over-exposed"] = 1.0
    gamma: Annotated[float, Bounds(0.2, 5), "exponent of grey values between 0 and 1; above 1: darker middle"] = 1.0
    depth_noise_1_m: Annotated[float, Bounds(0, 0.2), "error of a measured distance for each metre squared, metres"] = 0.004
    # fmt: on


class Sensor:
    """Adds noise to pictures and distances.

    Args:
        params: fidelity of the picture to the light.
        rng: for the noise.
    """

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
        noise = self._piece(image.size).reshape(image.shape)
        if params.shot_noise_grey > 0.0:
            noise = noise * self._deviation[image]
        out: ImageArray = cv2.add(image, noise, dtype=cv2.CV_8U).astype(np.uint8, copy=False)
        return out

    def stereo(self, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return distances as stereo measures them: quadratic error, blind next to edges."""
        noise = self._piece(depth_m.size).reshape(depth_m.shape)
        noise = noise * (self._params.depth_noise_1_m / self._unit)
        seen = depth_m * (1.0 + depth_m * noise)
        kernel = np.ones((_BLIND_PX, _BLIND_PX), np.uint8)
        step = cv2.dilate(depth_m, kernel) - cv2.erode(depth_m, kernel)
        blind = ~(step < _JUMP * depth_m)
        out: NDArray[np.float32] = np.where(blind, np.float32(np.nan), seen).astype(np.float32)
        return out

    def _piece(self, size: int) -> NDArray[np.float32]:
        """Return a slice of the prepared noise, different in each call."""
        start = int(self._rng.integers(0, _NOISE_STOCK))
        piece = self._stock[start : start + size]
        if len(piece) == size:
            return piece
        return np.take(self._stock, np.arange(start, start + size), mode="wrap")

"""A camera in front of a ChArUco board whose pose is known exactly.

Frames are like those of a camera: the lens distorts, edges are soft, the light decreases
to one side, pixels have noise. Not modelled: motion blur, rolling shutter, glare,
paper that is not flat.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import radians
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import CharucoBoard
from gazerig.robot.model.intrinsics import rays

Floats = NDArray[np.float64]

# Samples per pixel along each axis; a pixel is their mean.
_LOOKS = 2
_TEXTURE_PX_PER_MM = 2.0
_PAPER_EDGE_MM = 12.0
_WALL = 90.0


@dataclass(frozen=True)
class BoardCameraParams:
    """Quality of the frames."""

    width_px: Annotated[int, Bounds(64, 4096)] = 640
    height_px: Annotated[int, Bounds(64, 4096)] = 400
    blur_px: Annotated[float, Bounds(0, 10)] = 0.7
    noise_grey: Annotated[float, Bounds(0, 60)] = 3.0
    white: Annotated[float, Bounds(10, 255)] = 225.0
    black: Annotated[float, Bounds(0, 200)] = 28.0
    falloff: Annotated[float, Bounds(0, 0.9)] = 0.25


class BoardCamera:
    """Draws the board as a camera sees it from a given pose."""

    def __init__(
        self,
        params: BoardCameraParams,
        lens: Intrinsics,
        board: CharucoBoard,
        rng: np.random.Generator,
    ) -> None:
        self.params, self.lens, self.board = params, lens, board
        self._rng = rng
        edge = round(_PAPER_EDGE_MM * _TEXTURE_PX_PER_MM)
        drawn = board.image(_TEXTURE_PX_PER_MM).astype(np.float32) / 255.0
        grey = params.black + (params.white - params.black) * drawn
        self._paper = cv2.copyMakeBorder(
            grey, edge, edge, edge, edge, cv2.BORDER_CONSTANT, value=params.white
        )
        per_m = 1e3 * _TEXTURE_PX_PER_MM
        # Metres on the board to pixels of the texture, whose centres are at integers.
        self._from_board = np.array(
            [(per_m, 0.0, edge - 0.5), (0.0, per_m, edge - 0.5), (0.0, 0.0, 1.0)]
        )
        self._rays = _fine_rays(params.width_px, params.height_px, lens)
        share = np.linspace(0.0, params.falloff, params.width_px, dtype=np.float32)
        self._light = 1.0 - share[None, :]

    def image(self, R_camera_board: Mat3, p_camera_board_m: Vec3) -> ImageArray:
        """Return a frame of the board: (h, w, 3) BGR."""
        par = self.params
        pose = np.array(R_camera_board)
        # Board plane to the plane z = 1, and back.
        plane = np.stack((pose[:, 0], pose[:, 1], np.array(p_camera_board_m)), axis=1)
        back = np.linalg.inv(plane)
        looked = cv2.remap(
            self._paper,
            cv2.perspectiveTransform(self._rays, self._from_board @ back),
            np.empty(0, np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=_WALL,
        )
        # Rays that point away from the board's plane would meet it behind the camera.
        ends = self._rays[:: len(self._rays) - 1, :: self._rays.shape[1] - 1]
        if (ends @ back[2, :2] + back[2, 2]).min() <= 0.0:
            looked[self._rays @ back[2, :2] + back[2, 2] <= 0.0] = _WALL
        grey = cv2.resize(looked, (par.width_px, par.height_px), interpolation=cv2.INTER_AREA)
        if par.blur_px > 0.0:
            grey = cv2.GaussianBlur(grey, (0, 0), par.blur_px)
        noise = self._rng.standard_normal(grey.shape, dtype=np.float32)
        lit = np.clip(np.rint(grey * self._light + noise * par.noise_grey), 0, 255)
        return np.asarray(cv2.cvtColor(lit.astype(np.uint8), cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def true_lens(width_px: int, height_px: int, horizontal_field_deg: float = 69.0) -> Intrinsics:
    """Return a plausible lens that differs a little from its data sheet."""
    focal = 0.5 * width_px / np.tan(radians(0.5 * horizontal_field_deg)) * 1.03
    return Intrinsics(
        float(focal),
        float(focal * 1.004),
        0.5 * (width_px - 1) + 0.012 * width_px,
        0.5 * (height_px - 1) - 0.015 * width_px,
        (-0.11, 0.06, 0.0008, -0.0006, 0.0),
    )


@lru_cache(maxsize=4)
def _fine_rays(width_px: int, height_px: int, lens: Intrinsics) -> NDArray[np.float32]:
    """Return the rays of all pixels' samples at z = 1: (looks * h, looks * w, 2)."""
    steps = (np.arange(_LOOKS) + 0.5) / _LOOKS - 0.5
    x = (np.arange(width_px)[:, None] + steps).ravel()
    y = (np.arange(height_px)[:, None] + steps).ravel()
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    flat = rays(grid.reshape(-1, 2), lens)[:, :2].astype(np.float32)
    flat.setflags(write=False)
    return flat.reshape(grid.shape)

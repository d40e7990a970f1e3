"""A ChArUco board in front of an emulated head: first held by hand, then at rest.

The hand moves it everywhere, near and far, and tilts it to all sides, as the calibration
requires. The camera's true lens and mount differ a little from the rig file, so that the
calibration has an error to find. Frames are like those of a camera: the lens distorts, edges are
soft, the light decreases to one side, pixels have noise. Not modelled: motion blur, rolling
shutter, glare, paper that is not flat.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import cos, pi, radians, sin
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import ImageArray
from gazerig.gaze.angles import add, compose, rotate, rotate_back, sub
from gazerig.gaze.types import Angles3, HeadGeometry, Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import CharucoBoard
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens, rays

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


# The board has optical axes, so this board hangs upright in front of a head that looks along
# the world's x axis.
_R_WORLD_BOARD: Mat3 = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
_AWAY_M = 0.7
# Offset of the camera's true mount from the rig file.
_OFF_MM: Vec3 = (6.0, -4.0, 5.0)
_OFF_DEG: Angles3 = (2.0, -3.0, 1.5)


class BoardScene:
    """Frames of the board, taken on request.

    head_rad: angles of the emulated head; the caller sets them whenever it moves
    mount, lens: true mount and lens of the camera
    """

    def __init__(
        self,
        camera: CameraParams,
        board: CharucoBoard,
        geometry: HeadGeometry,
        rng: np.random.Generator,
        params: BoardCameraParams | None = None,
    ) -> None:
        par = params if params is not None else BoardCameraParams()
        self.mount, field_deg = offset_mount(camera), camera.horizontal_field_deg
        size = par.width_px, par.height_px
        # The calibrated lens, or one that differs a little from the stated field of view.
        self.lens = (
            true_lens(*size, field_deg)
            if camera.lens is None
            else intrinsics_of_lens(camera.lens, radians(field_deg), *size)
        )
        self.head_rad: Angles3 = (0.0, 0.0, 0.0)
        self._camera = BoardCamera(par, self.lens, board, rng)
        self._where = CameraMount(self.mount)
        self._geometry = geometry
        wide, high = board.size_m
        _, head = geometry.head_pose((0.0, 0.0, 0.0))
        centre = add(head, (_AWAY_M, 0.02, 0.01))
        self.p_world_board_m = sub(centre, rotate(_R_WORLD_BOARD, (wide / 2, high / 2, 0.0)))
        self.R_world_board = _R_WORLD_BOARD
        self._hanging = False
        self._number = 0

    def hang(self) -> None:
        """Hang the board up, upright and 0.7 m in front of the head."""
        self._hanging = True

    def look(self, now_s: float) -> Shot:
        """Return the next frame."""
        self._number += 1
        if self._hanging:
            pose = self.seen_pose(self.head_rad)
        else:
            pose = hand_held_pose(
                self._number - 1, self._camera.params, self.lens, self._camera.board
            )
        return Shot(now_s, self._number, self._camera.image(*pose))

    def seen_pose(self, head_rad: Angles3) -> tuple[Mat3, Vec3]:
        """Return R_camera_board and p_camera_board_m of the hanging board for neck angles."""
        R, p = self._where.pose(*self._geometry.head_pose(head_rad))
        a, b, c = R
        back: Mat3 = ((a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2]))
        return compose(back, self.R_world_board), rotate_back(R, sub(self.p_world_board_m, p))


def offset_mount(camera: CameraParams) -> CameraParams:
    """Return a mount a little off the mount of the rig file."""
    x, y, z = (mm + off for mm, off in zip(camera.position_mm, _OFF_MM, strict=True))
    return replace(
        camera,
        position_mm=(x, y, z),
        yaw_deg=camera.yaw_deg + _OFF_DEG[0],
        pitch_deg=camera.pitch_deg + _OFF_DEG[1],
        roll_deg=camera.roll_deg + _OFF_DEG[2],
    )


def hand_held_pose(
    number: int, params: BoardCameraParams, lens: Intrinsics, board: CharucoBoard
) -> tuple[Mat3, Vec3]:
    """Return R_camera_board and p_camera_board_m of the number-th pose in the hand, from 0.

    The poses are everywhere in the frame, near and far, tilted to all sides, and all different.
    """
    # Golden ratios spread any number of samples evenly.
    a, b, c = ((number + 0.5) * g % 1.0 for g in (0.7548776662, 0.5698402910, 0.6180339887))
    fills = 0.38 + 0.34 * c
    tilt, about = radians(12.0 + 26.0 * ((number * 0.41) % 1.0)), 2.0 * pi * c + number * pi / 2
    turn, _ = cv2.Rodrigues(tilt * np.array((cos(about), sin(about), 0.0)))
    spin, _ = cv2.Rodrigues(np.array((0.0, 0.0, radians(15.0) * (2.0 * b - 1.0))))
    R = turn @ spin
    wide, high = board.size_m
    away = lens.fx_px * wide / (fills * params.width_px)
    # Sometimes a part of it is out of the frame.
    fills_height = fills * (params.width_px / params.height_px) * high / wide
    u = params.width_px * (0.5 + (0.5 - 0.4 * fills) * (2.0 * a - 1.0))
    v = params.height_px * (0.5 + (0.5 - 0.4 * fills_height) * (2.0 * b - 1.0))
    centre = away * rays(np.array([(u, v)]), lens)[0]
    p = centre - R @ (wide / 2, high / 2, 0.0)
    rows = [(row[0], row[1], row[2]) for row in R.tolist()]
    return (rows[0], rows[1], rows[2]), (float(p[0]), float(p[1]), float(p[2]))

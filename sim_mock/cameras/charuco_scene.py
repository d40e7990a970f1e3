"""A ChArUco board in front of an emulated head: first held by hand, then at rest.

The hand moves it everywhere, near and far, and tilts it to all sides, as the calibration
requires. The camera's true lens and mount differ a little from the rig file, so that the
calibration has an error to find. The lens distorts, edges are soft, pixels have noise. Not
modelled: motion blur, glare, paper that is not flat.
"""

from dataclasses import replace
from math import cos, pi, radians, sin

import cv2
import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import ImageArray
from gazerig.gaze.angles import add, compose, rotate, rotate_back, sub
from gazerig.gaze.types import Angles3, HeadGeometry, Mat3, Vec3
from gazerig.robot.model.charuco_board import CharucoBoard
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens, rays
from gazerig.robot.model.scene_view import PinholeView, Rendered
from gazerig.sim_mock.cameras.optics import Sensor, SensorParams, through_lens

SIZE_PX = (640, 400)
_TEXTURE_PX_PER_MM, _PAPER_EDGE_MM = 2.0, 12.0
_WHITE, _BLACK, _WALL = 210.0, 28.0, 90.0
_BLUR_PX = 0.7
# The board has optical axes, so this board hangs upright in front of a head that looks along
# the world's x axis.
_R_WORLD_BOARD: Mat3 = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
_AWAY_M = 0.7
# Offset of the camera's true mount from the rig file.
_OFF_MM: Vec3 = (6.0, -4.0, 5.0)
_OFF_DEG: Angles3 = (2.0, -3.0, 1.5)


class HeldBoard:
    """SceneView of a board alone; poses of the camera are in the frame of the board."""

    def __init__(self, board: CharucoBoard) -> None:
        edge = round(_PAPER_EDGE_MM * _TEXTURE_PX_PER_MM)
        grey = _BLACK + (_WHITE - _BLACK) / 255.0 * board.image(_TEXTURE_PX_PER_MM)
        paper = cv2.copyMakeBorder(
            grey, edge, edge, edge, edge, cv2.BORDER_CONSTANT, value=(_WHITE,)
        )
        self._paper = cv2.cvtColor(np.rint(paper).astype(np.uint8), cv2.COLOR_GRAY2BGR)
        per_px = 1e-3 / _TEXTURE_PX_PER_MM
        # Pixels of the texture, whose centres are at integers, to metres on the board.
        self._to_board = np.array(
            [(per_px, 0.0, (0.5 - edge) * per_px), (0.0, per_px, (0.5 - edge) * per_px), (0, 0, 1)]
        )

    def draw(self, seen_by: PinholeView, *, depth: bool = False) -> Rendered:
        """Return a picture; see ``SceneView.draw``."""
        back = np.array(seen_by.R).T
        plane = np.stack((back[:, 0], back[:, 1], -back @ seen_by.p_m), axis=1)
        image = cv2.warpPerspective(
            self._paper,
            seen_by.lens.matrix @ plane @ self._to_board,
            seen_by.size_px,
            flags=cv2.INTER_LINEAR,
            borderValue=(_WALL, _WALL, _WALL),
        )
        return Rendered(np.asarray(image, np.uint8), None)

    def close(self) -> None:
        """Do nothing: there is nothing to free."""


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
    ) -> None:
        x, y, z = add(camera.position_mm, _OFF_MM)
        yaw, pitch, roll = add((camera.yaw_deg, camera.pitch_deg, camera.roll_deg), _OFF_DEG)
        self.mount = replace(
            camera, position_mm=(x, y, z), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll
        )
        field_deg = camera.horizontal_field_deg
        # The calibrated lens, or one that differs a little from the stated field of view.
        self.lens = (
            true_lens(field_deg)
            if camera.lens is None
            else intrinsics_of_lens(camera.lens, radians(field_deg), *SIZE_PX)
        )
        self.head_rad: Angles3 = (0.0, 0.0, 0.0)
        self._board, self._view = board, HeldBoard(board)
        self._sensor = Sensor(SensorParams(), rng)
        self._where, self._geometry = CameraMount(self.mount), geometry
        wide, high = board.size_m
        _, head = geometry.head_pose((0.0, 0.0, 0.0))
        centre = add(head, (_AWAY_M, 0.02, 0.01))
        self._p_world_board_m = sub(centre, rotate(_R_WORLD_BOARD, (wide / 2, high / 2, 0.0)))
        self._is_hanging = False
        self._number = 0

    def hang(self) -> None:
        """Hang the board up, upright and 0.7 m in front of the head."""
        self._is_hanging = True

    def look(self, now_s: float) -> Shot:
        """Return the next frame."""
        self._number += 1
        if self._is_hanging:
            pose = self.seen_pose(self.head_rad)
        else:
            pose = hand_held_pose(self._number - 1, self.lens, self._board)
        return Shot(now_s, self._number, self.image(*pose))

    def image(self, R_camera_board: Mat3, p_camera_board_m: Vec3) -> ImageArray:
        """Return a frame of the board: (h, w, 3) BGR."""
        R = _transpose(R_camera_board)
        p_m = sub((0.0, 0.0, 0.0), rotate(R, p_camera_board_m))
        seen = through_lens(self._view, PinholeView(0.0, self.lens, SIZE_PX, R, p_m))
        soft = cv2.GaussianBlur(seen.image, (0, 0), _BLUR_PX)
        return self._sensor.image(np.asarray(soft, np.uint8))

    def seen_pose(self, head_rad: Angles3) -> tuple[Mat3, Vec3]:
        """Return R_camera_board and p_camera_board_m of the hanging board for neck angles."""
        R, p_m = self._where.pose(*self._geometry.head_pose(head_rad))
        to_board_m = rotate_back(R, sub(self._p_world_board_m, p_m))
        return compose(_transpose(R), _R_WORLD_BOARD), to_board_m


def true_lens(horizontal_field_deg: float = 69.0) -> Intrinsics:
    """Return a plausible lens that differs a little from its data sheet."""
    width_px, height_px = SIZE_PX
    focal = 0.5 * width_px / np.tan(radians(0.5 * horizontal_field_deg)) * 1.03
    return Intrinsics(
        float(focal),
        float(focal * 1.004),
        0.5 * (width_px - 1) + 0.012 * width_px,
        0.5 * (height_px - 1) - 0.015 * width_px,
        (-0.11, 0.06, 0.0008, -0.0006, 0.0),
    )


def hand_held_pose(number: int, lens: Intrinsics, board: CharucoBoard) -> tuple[Mat3, Vec3]:
    """Return R_camera_board and p_camera_board_m of the number-th pose in the hand, from 0.

    The poses are everywhere in the frame, near and far, tilted to all sides, and all different.
    """
    width_px, height_px = SIZE_PX
    # Golden ratios spread any number of samples evenly.
    a, b, c = ((number + 0.5) * g % 1.0 for g in (0.7548776662, 0.5698402910, 0.6180339887))
    fills = 0.38 + 0.34 * c
    tilt, about = radians(12.0 + 26.0 * ((number * 0.41) % 1.0)), 2.0 * pi * c + number * pi / 2
    turn, _ = cv2.Rodrigues(tilt * np.array((cos(about), sin(about), 0.0)))
    spin, _ = cv2.Rodrigues(np.array((0.0, 0.0, radians(15.0) * (2.0 * b - 1.0))))
    R = turn @ spin
    wide, high = board.size_m
    away = lens.fx_px * wide / (fills * width_px)
    # Sometimes a part of it is out of the frame.
    fills_height = fills * (width_px / height_px) * high / wide
    u = width_px * (0.5 + (0.5 - 0.4 * fills) * (2.0 * a - 1.0))
    v = height_px * (0.5 + (0.5 - 0.4 * fills_height) * (2.0 * b - 1.0))
    x, y, z = (away * rays(np.array([(u, v)]), lens)[0] - R @ (wide / 2, high / 2, 0.0)).tolist()
    first, second, third = (tuple(row) for row in R.tolist())
    return (first, second, third), (x, y, z)


def _transpose(R: Mat3) -> Mat3:
    first, second, third = zip(*R, strict=True)
    return first, second, third

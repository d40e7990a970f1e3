"""A ChArUco board in front of an emulated head: first held by hand, then at rest.

The hand moves it everywhere, near and far, and tilts it to all sides, as the calibration
requires. The camera's true lens and mount differ a little from the rig file, so that the
calibration has an error to find. Not modelled: distortion, motion blur, glare, bent paper.
"""

from dataclasses import replace
from math import cos, pi, radians, sin

import cv2
import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import ImageArray
from gazerig.gaze.angles import add
from gazerig.gaze.types import Angles3, Floats, HeadGeometry, Vec3
from gazerig.robot.model.charuco_board import CharucoBoard
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens

SIZE_PX = (640, 400)
BoardPose = tuple[Floats, Floats]
"""Rotation (3, 3) of the board in the camera, and its position (3,), m."""
_TEXTURE_PX_PER_MM = 2.0
_WALL, _NOISE_GREY = 90.0, 3.0
# The board has optical axes, so this board hangs upright in front of a head that looks along
# the world's x axis.
_R_WORLD_BOARD = np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))
_AWAY_M: Vec3 = (0.7, 0.02, 0.01)
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
        self._board, self._rng, self._geometry = board, rng, geometry
        _, head = geometry.head_pose((0.0, 0.0, 0.0))
        wide, high = board.size_m
        self._p_world_board_m = np.add(head, _AWAY_M) - _R_WORLD_BOARD @ (wide / 2, high / 2, 0.0)
        self._is_hanging = False
        self._number = 0

    def hang(self) -> None:
        """Hang the board up, upright and 0.7 m in front of the head."""
        self._is_hanging = True

    def look(self, now_s: float) -> Shot:
        """Return the next frame."""
        self._number += 1
        pose = (
            self.seen_pose(self.head_rad)
            if self._is_hanging
            else hand_held_pose(self._number - 1, self.lens, self._board)
        )
        return Shot(now_s, self._number, self.image(pose))

    def image(self, pose: BoardPose) -> ImageArray:
        """Return a frame of the board: (h, w, 3) BGR."""
        texture = self._board.image(_TEXTURE_PX_PER_MM)
        high, wide = texture.shape[:2]
        # Pixels have their centres at whole numbers.
        corners = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
        board_m = np.column_stack((corners * self._board.size_m, np.zeros(4)))
        R, p_m = pose
        seen_px, _ = cv2.projectPoints(board_m, R, p_m, self.lens.matrix, None)
        paper_px = (corners * (wide, high) - 0.5).astype(np.float32)
        warp = cv2.getPerspectiveTransform(paper_px, seen_px.astype(np.float32))
        grey = cv2.warpPerspective(30.0 + 0.7 * texture, warp, SIZE_PX, borderValue=(_WALL,))
        noisy = grey + self._rng.normal(0.0, _NOISE_GREY, grey.shape)
        return np.repeat(np.clip(noisy, 0.0, 255.0).astype(np.uint8)[..., None], 3, axis=2)

    def seen_pose(self, head_rad: Angles3) -> BoardPose:
        """Return the pose of the hanging board for neck angles."""
        R, p_m = CameraMount(self.mount).pose(*self._geometry.head_pose(head_rad))
        back = np.array(R).T
        return back @ _R_WORLD_BOARD, back @ (self._p_world_board_m - p_m)


def true_lens(horizontal_field_deg: float = 69.0) -> Intrinsics:
    """Return a plausible lens that differs a little from its data sheet."""
    width_px, height_px = SIZE_PX
    focal = 0.5 * width_px / np.tan(radians(0.5 * horizontal_field_deg)) * 1.03
    return Intrinsics(
        float(focal),
        float(focal * 1.004),
        0.5 * (width_px - 1) + 0.012 * width_px,
        0.5 * (height_px - 1) - 0.015 * width_px,
    )


def hand_held_pose(number: int, lens: Intrinsics, board: CharucoBoard) -> BoardPose:
    """Return the number-th pose in the hand, from 0.

    The poses are everywhere in the frame, near and far, tilted to all sides, and all different.
    """
    # Golden ratios spread any number of samples evenly.
    a, b, c = ((number + 0.5) * g % 1.0 for g in (0.7548776662, 0.5698402910, 0.6180339887))
    fills = 0.38 + 0.34 * c
    tilt, about = radians(12.0 + 26.0 * ((number * 0.41) % 1.0)), 2.0 * pi * c + number * pi / 2
    spin = radians(15.0) * (2.0 * b - 1.0)
    turn, _ = cv2.Rodrigues(np.array((tilt * cos(about), tilt * sin(about), spin)))
    R = np.asarray(turn, float)
    size_px, board_m = np.array(SIZE_PX), np.array(board.size_m)
    away_m = lens.fx_px * board_m[0] / (fills * size_px[0])
    # Sometimes a part of it is out of the frame.
    share = fills * board_m / board_m[0] * size_px[0] / size_px
    middle_px = size_px * (0.5 + (0.5 - 0.4 * share) * (2.0 * np.array((a, b)) - 1.0))
    ray = np.linalg.inv(lens.matrix) @ (*middle_px, 1.0)
    return R, away_m * ray - R @ (*(0.5 * board_m), 0.0)

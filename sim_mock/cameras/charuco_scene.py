"""A ChArUco board in front of an emulated head: first held by hand, then at rest.

The hand moves it everywhere, near and far, and tilts it to all sides, as the calibration
requires. The camera's lens, and its mount a little, differ from the rig file, so that the
calibration has an error to find. Not modelled: distortion, noise, motion blur, glare, bent paper.
"""

from dataclasses import replace

import cv2
import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.charuco_board import CharucoBoard
from gazerig.gaze.angles import add
from gazerig.gaze.types import Angles3, Floats, HeadGeometry
from gazerig.robot.model.frames import CameraMount, CameraParams

SIZE_PX = (640, 400)
BOARD_LENS = Intrinsics(480.0, 482.0, 327.0, 190.0)
"""The true lens: a webcam with a field of 67 deg."""
BoardPose = tuple[Floats, Floats]
"""Rotation (3, 3) of the board in the camera, and its position (3,), m."""
_TEXTURE_PX_PER_MM, _WALL_GREY = 2.0, 90.0
_AWAY_M = 0.7
_OFF_MM, _OFF_DEG = (6.0, -4.0, 5.0), 2.0
"""Offset of the camera's true place and yaw from the rig file."""


class BoardScene:
    """Frames of the board, taken on request.

    head_rad: angles of the emulated head, which the caller sets whenever it moves; None: the board
        is still held by hand
    mount: true mount of the camera
    """

    def __init__(self, camera: CameraParams, board: CharucoBoard, geometry: HeadGeometry) -> None:
        self.mount = replace(
            camera, position_mm=add(camera.position_mm, _OFF_MM), yaw_deg=camera.yaw_deg + _OFF_DEG
        )
        self.head_rad: Angles3 | None = None
        self._board, self._geometry, self._number = board, geometry, 0

    def look(self, now_s: float) -> Shot:
        """Return the next frame."""
        self._number += 1
        if self.head_rad is None:
            pose = hand_held_pose(self._number, self._board)
        else:
            pose = self.seen_pose(self.head_rad)
        return Shot(now_s, self._number, self.image(pose))

    def image(self, pose: BoardPose) -> ImageArray:
        """Return a frame of the board: (h, w, 3) BGR."""
        R, p_m = pose
        px_m = 1e-3 / _TEXTURE_PX_PER_MM
        warp = BOARD_LENS.matrix @ np.column_stack((px_m * R[:, :2], p_m))
        texture = self._board.image(_TEXTURE_PX_PER_MM)
        grey = cv2.warpPerspective(texture, warp, SIZE_PX, borderValue=(_WALL_GREY,))
        return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)

    def seen_pose(self, head_rad: Angles3) -> BoardPose:
        """Return the pose of the board, which hangs before the camera of a head at rest."""
        wide, high = self._board.size_m
        (R, p_m), (R_board, rest_m) = map(self._camera_pose, (head_rad, (0.0, 0.0, 0.0)))
        board_m = rest_m + R_board @ (-0.5 * wide, -0.5 * high, _AWAY_M)
        return R.T @ R_board, R.T @ (board_m - p_m)

    def _camera_pose(self, head_rad: Angles3) -> BoardPose:
        R, p_m = CameraMount(self.mount).pose(*self._geometry.head_pose(head_rad))
        return np.array(R), np.array(p_m)


def hand_held_pose(number: int, board: CharucoBoard) -> BoardPose:
    """Return the number-th pose in the hand: anywhere in the frame, at any distance and tilt."""
    wide, high = board.size_m
    # Multiples of these roots spread any number of samples evenly.
    shares = number * np.sqrt((2.0, 3.0, 5.0, 7.0, 11.0, 13.0)) % 1.0 - 0.5
    R = np.asarray(cv2.Rodrigues(0.9 * shares[:3])[0], float)
    x, y, away = shares[3:] + (0.0, 0.0, 1.5)
    # The middle of the board in its widths: most of the board stays in the frame.
    middle = np.array((x * (1.34 * away - 0.8), y * (0.84 * away - 0.6), away))
    return R, wide * middle - R @ (0.5 * wide, 0.5 * high, 0.0)

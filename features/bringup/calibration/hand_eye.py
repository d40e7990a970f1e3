"""Pose of the camera on the head, from one fixed board seen at several neck angles. Pure.

Hand-eye calibration, AX = XB: the joints measure the motion of the head, the camera measures the
apparent motion of the board, and only one pose of the camera on the head makes both agree. OpenCV's
closed form (manual, cv2.calibrateHandEye; Park and Martin 1994) is the start of one least-squares
fit of all corners in all views, in which outlying corners have less weight (Huber).

Joint sensors are not exact (steps of 0.088 deg, play of the gears), and an error of 0.1 deg of the
head shifts a board at 0.7 m by more than all errors of its corners. So each view also has a small
rotation of the head as an unknown. The lens is not known exactly either: 1 % of its focal length is
7 mm of the camera's position. So focal length and centre may change within their usual errors.
Frames as in gazerig.robot.model.frames; the board's as in gazerig.drivers.vision.charuco_board.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, radians
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.vision.charuco_board import DetectedBoard
from gazerig.features.bringup.calibration.board_views import board_pose
from gazerig.features.bringup.calibration.lens_calibration import (
    WIDTH_PX,
    CameraCalibrationRefused,
)
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraParams, camera_at_pose
from gazerig.robot.model.intrinsics import project

Floats = NDArray[np.float64]

LEAST_VIEWS = 8
MOST_ERROR_PX = 5.0
"""Largest root mean square reprojection error of an image 640 px wide."""
MOST_ERROR_MM, MOST_ERROR_DEG = 5.0, 0.6
"""Largest standard deviations of the camera's position and direction."""

# Usual errors of a corner, a neck joint (steps, play), and a calibrated lens.
_CORNER_PX, _JOINT_RAD = 0.3, radians(0.15)
_LENS = np.array((0.0015, 1.0, 1.0))  # focal length, relative; centre in images 640 px wide
_HUBER = 1.345  # 95 % efficiency for normal noise
_SHARED = 15  # unknowns that all views share: poses of camera and board, lens


class NeckView(NamedTuple):
    """View of the board: the head's pose at the time of a frame, and the board in the frame."""

    R_world_head: Mat3
    p_world_head_m: Vec3
    seen: DetectedBoard


@dataclass(frozen=True, slots=True)
class HandEye:
    """Result of the hand-eye calibration.

    R_head_camera, p_head_camera_m: pose of the camera in the head
    lens: the input lens, with focal length and centre corrected by the same fit; it belongs to
        this pose of the camera
    rms_px: root mean square reprojection error with the measured joint angles
    joint_error_deg: root mean square of the estimated joint errors
    position_std_mm, angle_std_deg: standard deviations along and about the camera's axes; they do
        not include errors of the rig's geometry
    """

    R_head_camera: Mat3
    p_head_camera_m: Vec3
    lens: Intrinsics
    rms_px: float
    joint_error_deg: float
    position_std_mm: Floats
    angle_std_deg: Floats

    def camera_params(self, params: CameraParams) -> CameraParams:
        """Return the camera at the calibrated pose."""
        return camera_at_pose(params, self.R_head_camera, self.p_head_camera_m)


def camera_on_head(views: Sequence[NeckView], lens: Intrinsics, width_px: int) -> HandEye:
    """Find the pose of the camera on the head.

    width_px: width of the frames; limits in pixels scale with it

    Raises:
        CameraCalibrationRefused: too few views, rotations about one axis only, or the result is
            not good or not certain enough.
    """
    from scipy.optimize import least_squares  # takes a moment to load

    if len(views) < LEAST_VIEWS:
        raise CameraCalibrationRefused(
            f"the board was seen from {len(views)} neck angles, wanted are {LEAST_VIEWS}: hang "
            "it where the camera sees all of it while the head looks straight ahead, in good light"
        )
    problem = _Problem(views, lens, width_px)
    try:
        found = least_squares(
            problem.residuals,
            np.zeros(_SHARED + 3 * len(views)),
            x_scale="jac",
            loss="huber",
            f_scale=_HUBER,
        )
        # The Jacobian of robust losses is scaled so that this is their curvature.
        spread = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))[:6]
    except (cv2.error, ValueError, np.linalg.LinAlgError) as error:
        raise CameraCalibrationRefused(
            "the images of the board agree with no place of the camera: see that board, lens and "
            "joints are the ones calibrated, and that the head turns to the sides and nods as well"
        ) from error
    made = problem.result(found.x, spread)
    _judge(made, MOST_ERROR_PX * width_px / WIDTH_PX)
    return made


class _Problem:
    """All corners in all views, and the camera and board that shall explain them.

    Unknowns are displacements: rotation and position of the camera in the head, and of the board
    in the world, from their start; lens; three rotations of the head in each view.
    """

    def __init__(self, views: Sequence[NeckView], lens: Intrinsics, width_px: int) -> None:
        counts = [len(view.seen.ids) for view in views]
        self._view = np.repeat(np.arange(len(views)), counts)
        self._R = np.array([view.R_world_head for view in views])
        self._p = np.array([view.p_world_head_m for view in views])
        self._corners_m = np.concatenate([view.seen.corners_board_m for view in views])
        self._corners_px = np.concatenate([view.seen.corners_px for view in views])
        self._lens = lens
        self._lens_error = _LENS * (1.0, width_px / WIDTH_PX, width_px / WIDTH_PX)
        posed = [(k, pose) for k, view in enumerate(views) if (pose := board_pose(view.seen, lens))]
        heads, boards = [k for k, _ in posed], [pose for _, pose in posed]
        R, p = cv2.calibrateHandEye(
            list(self._R[heads]), list(self._p[heads]), [R for R, _ in boards],
            [p for _, p in boards], method=cv2.CALIB_HAND_EYE_PARK,
        )  # fmt: skip
        self._camera = np.array(R, dtype=np.float64), np.array(p, dtype=np.float64)[:, 0]
        # The board where the first view shows it.
        first, (R_board, p_board) = heads[0], boards[0]
        in_head = self._camera[0] @ p_board + self._camera[1]
        self._board = (
            self._R[first] @ self._camera[0] @ R_board,
            self._R[first] @ in_head + self._p[first],
        )

    def lens(self, x: Floats) -> Intrinsics:
        zoom, right, down = x[12:_SHARED].tolist()
        lens = self._lens
        return replace(
            lens,
            fx_px=lens.fx_px * (1.0 + zoom),
            fy_px=lens.fy_px * (1.0 + zoom),
            cx_px=lens.cx_px + right,
            cy_px=lens.cy_px + down,
        )

    def errors_px(self, x: Floats) -> Floats:
        """Return the reprojection errors of all corners: (n, 2)."""
        R, p = _displace(self._camera, x[:6])
        R_board, p_board = _displace(self._board, x[6:12])
        world = self._corners_m @ R_board.T + p_board - self._p[self._view]
        head = np.einsum("nji,nj->ni", self._R[self._view], world)
        # The rotations are so small that their squares are negligible.
        head -= np.cross(x[_SHARED:].reshape(-1, 3)[self._view], head)
        return np.asarray(project((head - p) @ R, self.lens(x)) - self._corners_px)

    def residuals(self, x: Floats) -> Floats:
        """Return errors of corners, lens and joints, each relative to its usual error."""
        lens, turns = x[12:_SHARED] / self._lens_error, x[_SHARED:] / _JOINT_RAD
        return np.concatenate((self.errors_px(x).ravel() / _CORNER_PX, lens, turns))

    def result(self, x: Floats, spread: Floats) -> HandEye:
        """Return the result for the best displacement; spread: standard deviations."""
        (R, p), turns = _displace(self._camera, x[:6]), x[_SHARED:].copy()
        plain = x.copy()
        plain[_SHARED:] = 0.0
        return HandEye(
            (_vec3(R[0]), _vec3(R[1]), _vec3(R[2])),
            _vec3(p),
            self.lens(x),
            _rms(np.linalg.norm(self.errors_px(plain), axis=1)),
            degrees(_rms(turns)),
            spread[3:] * 1e3,
            np.degrees(spread[:3]),
        )


def _judge(found: HandEye, most_px: float) -> None:
    """Refuse a result with too large errors or standard deviations."""
    if not found.rms_px <= most_px:
        raise CameraCalibrationRefused(
            f"reprojection error {found.rms_px:.2f} px, wanted at most {most_px:.2f}: see that the "
            "board hangs still, the lens is calibrated at this image size, and the neck "
            "joints' zeros and signs and the rig's geometry are right"
        )
    mm, deg = float(found.position_std_mm.max()), float(found.angle_std_deg.max())
    if not (mm <= MOST_ERROR_MM and deg <= MOST_ERROR_DEG):
        raise CameraCalibrationRefused(
            f"the camera's place is sure to {mm:.1f} mm and {deg:.2f} deg only, wanted are "
            f"{MOST_ERROR_MM:g} mm and {MOST_ERROR_DEG:g} deg: turn the head farther, to the sides "
            "and up and down, hang the board nearer, or take more views"
        )


def _displace(pose: tuple[Floats, Floats], step: Floats) -> tuple[Floats, Floats]:
    """Rotate a pose about its own axes, and shift it along its parent's."""
    R, p = pose
    return R @ np.asarray(cv2.Rodrigues(step[:3])[0]), p + step[3:]


def _rms(values: Floats) -> float:
    return float(np.sqrt((values * values).mean()))


def _vec3(row: Floats) -> Vec3:
    x, y, z = row.tolist()
    return x, y, z

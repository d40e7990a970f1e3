"""Factory calibration of an OAK camera, in the terms of the rig file."""

from math import atan, degrees
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.pinhole import Distortion, Intrinsics
from gazerig.drivers.errors import CameraError

Floats = NDArray[np.float64]
Vec3 = tuple[float, float, float]

_LEAST_FOCAL_PX = 10.0
_STRAIGHT: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
_MOST_FIT_PX = 1.0
_PRECISELY = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
_AXES = np.eye(3)
_NO_LENS = "the calibration of this OAK camera does not contain the lens of its colour camera"
_BOARD = "measure it with the printed board instead (leave --oak away)"


def rotation_matrix(vector_deg: tuple[float, float, float]) -> Floats:
    """Return the rotation (3, 3) about a vector by its length in degrees (Rodrigues)."""
    x, y, z = np.radians(vector_deg)
    angle = float(np.linalg.norm((x, y, z)))
    K = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    # sin(a) / a and (1 - cos(a)) / a^2, both also accurate at 0.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + first * K + second * (K @ K))


def imu_to_camera(dai: Any, calibration: Any) -> Floats | None:
    """Return R_camera_imu (3, 3); None if the calibration does not contain it."""
    try:
        found = calibration.getImuToCameraExtrinsics(dai.CameraBoardSocket.CAM_A)
    except RuntimeError:
        return None
    R = np.asarray(found, dtype=np.float64)[:3, :3]
    # A memory that was never written contains zeros.
    return R if np.abs(R @ R.T - np.eye(3)).max() < 1e-2 else None


class OakCalibration(NamedTuple):
    """Calibration of the colour camera in the memory of an OAK camera.

    label: product name
    lens: lens of the frames that the rig requests; without distortion if the camera undistorts them
    width_px, height_px: size of these frames
    raw_distortion: k1 k2 p1 p2 k3 of the lens itself, fitted to the factory's model of it
    fit_error_px: residual of that fit, root mean square over the frame
    R_camera_imu: takes directions from the gyro's axes to the camera's; None if unknown
    left_camera_m, right_camera_m: positions of the stereo cameras in the colour camera's axes; None
        if unknown
    focus: lens position at which it was measured, None if it is fixed or unknown
    """

    label: str
    lens: Intrinsics
    width_px: int
    height_px: int
    raw_distortion: Distortion
    fit_error_px: float
    R_camera_imu: Floats | None
    left_camera_m: Vec3 | None
    right_camera_m: Vec3 | None
    focus: int | None

    @property
    def horizontal_field_deg(self) -> float:
        """Return the horizontal field of view of an undistorted frame, from edge to edge."""
        left = (self.lens.cx_px + 0.5) / self.lens.fx_px
        right = (self.width_px - 0.5 - self.lens.cx_px) / self.lens.fx_px
        return degrees(atan(left) + atan(right))

    @property
    def imu_rotation_deg(self) -> Vec3 | None:
        """Return the gyro's orientation as a rotation vector, degrees."""
        if self.R_camera_imu is None:
            return None
        x, y, z = np.degrees(cv2.Rodrigues(self.R_camera_imu)[0].ravel()).tolist()
        return x, y, z


def read_calibration(dai: Any, calibration: Any, params: OakParams) -> OakCalibration:
    """Return the calibration of the frames that the rig requests.

    Raises:
        CameraError: it does not contain the colour camera's lens, or the lens cannot be used.
    """
    socket, size = dai.CameraBoardSocket, (params.width_px, params.height_px)
    try:
        matrix = calibration.getCameraIntrinsics(socket.CAM_A, *size)
        K = np.asarray(matrix, dtype=np.float64)
        coefficients = np.asarray(calibration.getDistortionCoefficients(socket.CAM_A), np.float64)
        fisheye = calibration.getDistortionModel(socket.CAM_A) == dai.CameraModel.Fisheye
        focus = int(calibration.getLensPosition(socket.CAM_A))
    except (RuntimeError, TypeError) as error:
        raise CameraError(f"{_NO_LENS} ({' '.join(str(error).split())}): {_BOARD}") from error
    if not np.isfinite(K).all() or min(K[0, 0], K[1, 1]) < _LEAST_FOCAL_PX:
        raise CameraError(f"{_NO_LENS}: {_BOARD}")
    # k1 k2 p1 p2 k3 are fitted to a lens of any OpenCV model.
    u, v = np.meshgrid(np.linspace(0, size[0] - 1, 33), np.linspace(0, size[1] - 1, 21))
    pixels = np.column_stack((u.ravel(), v.ravel()))[:, None]
    if fisheye:
        rays = cv2.fisheye.undistortPoints(pixels, K, coefficients[:4])[:, 0]
    else:
        rays = cv2.undistortPointsIter(pixels, K, coefficients, _AXES, _AXES, _PRECISELY)[:, 0]
    seen = (pixels[:, 0] - K[:2, 2]) / K[[0, 1], [0, 1]]
    x, y = np.asarray(rays, dtype=np.float64).T
    r2 = x * x + y * y
    # The model of the OpenCV manual is linear in its five numbers.
    of_x = np.column_stack((x * r2, x * r2**2, 2 * x * y, r2 + 2 * x * x, x * r2**3))
    of_y = np.column_stack((y * r2, y * r2**2, r2 + 2 * y * y, 2 * x * y, y * r2**3))
    table, right = np.vstack((of_x, of_y)), np.concatenate((seen[:, 0] - x, seen[:, 1] - y))
    if not (np.isfinite(table).all() and np.isfinite(right).all()):
        own, fit_px = _STRAIGHT, np.inf
    else:
        numbers = np.linalg.lstsq(table, right, rcond=None)[0]
        left = (table @ numbers - right).reshape(2, -1) * K[[0, 1], [0, 1]][:, None]
        a, b, c, d, e = numbers.tolist()
        own, fit_px = (a, b, c, d, e), float(np.sqrt((left**2).sum(axis=0).mean()))
    if not params.undistort and not fit_px <= _MOST_FIT_PX:
        raise CameraError(
            f"the lens of this OAK camera bends frames more than k1 k2 p1 p2 k3 can describe "
            f"({fit_px:.1f} px are left): set oak.undistort: true"
        )
    distortion = _STRAIGHT if params.undistort else own
    about = calibration.getEepromData()
    return OakCalibration(
        str(about.productName or about.boardName or "OAK camera"),
        Intrinsics(float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]), distortion),
        *size,
        own,
        fit_px,
        imu_to_camera(dai, calibration),
        _camera_position_m(calibration, socket.CAM_B, socket.CAM_A),
        _camera_position_m(calibration, socket.CAM_C, socket.CAM_A),
        focus or None,
    )


def _camera_position_m(calibration: Any, socket: Any, colour: Any) -> Vec3 | None:
    """Return a camera's position in the colour camera's axes, metres; None if unknown."""
    try:
        found = np.asarray(calibration.getCameraExtrinsics(socket, colour), dtype=np.float64)
    except RuntimeError:
        return None
    if found.shape != (4, 4) or not np.isfinite(found).all():
        return None
    x, y, z = (found[:3, 3] / 100.0).tolist()
    return x, y, z

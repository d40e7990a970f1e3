"""Factory calibration of an OAK camera: the distortion of its colour lens."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.pinhole import Distortion
from gazerig.drivers.errors import CameraError

Floats = NDArray[np.float64]

_MOST_FIT_PX = 1.0
_PRECISELY = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
_AXES = np.eye(3)


def raw_distortion(dai: Any, calibration: Any, params: OakParams) -> Distortion:
    """Return k1 k2 p1 p2 k3 of the colour camera's lens, fitted to the factory's model of it.

    Raises:
        CameraError: the memory does not contain the lens, or five numbers cannot describe it.
    """
    socket, size = dai.CameraBoardSocket.CAM_A, (params.width_px, params.height_px)
    try:
        K = np.asarray(calibration.getCameraIntrinsics(socket, *size), np.float64)
        coefficients = np.asarray(calibration.getDistortionCoefficients(socket), np.float64)
        fisheye = calibration.getDistortionModel(socket) == dai.CameraModel.Fisheye
    except (RuntimeError, TypeError) as error:
        raise CameraError(
            "the memory of this OAK camera does not contain its lens "
            f"({' '.join(str(error).split())}): set oak.undistort: true"
        ) from error
    # A lens of any OpenCV model: rays through a grid of pixels.
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
    fit_px = np.inf
    if np.isfinite(table).all() and np.isfinite(right).all():
        numbers = np.linalg.lstsq(table, right, rcond=None)[0]
        left = (table @ numbers - right).reshape(2, -1) * K[[0, 1], [0, 1]][:, None]
        fit_px = float(np.sqrt((left**2).sum(axis=0).mean()))
    if not fit_px <= _MOST_FIT_PX:
        raise CameraError(
            f"the lens of this OAK camera bends frames more than k1 k2 p1 p2 k3 can describe "
            f"({fit_px:.1f} px are left): set oak.undistort: true"
        )
    a, b, c, d, e = numbers.tolist()
    return a, b, c, d, e

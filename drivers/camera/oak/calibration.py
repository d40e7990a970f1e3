"""What the factory's calibration of an OAK camera says, in the terms of the rig's file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rotation_of(vector_deg: tuple[float, float, float]) -> Floats:
    """Return the rotation (3, 3) about a vector by its length in degrees (Rodrigues)."""
    x, y, z = np.radians(vector_deg)
    angle = float(np.linalg.norm((x, y, z)))
    K = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    # sin(a) / a and (1 - cos(a)) / a^2, both good at 0 too.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + first * K + second * (K @ K))


def imu_to_camera(dai: Any, calibration: Any) -> Floats | None:
    """Return R_camera_imu (3, 3); None where the calibration does not hold it."""
    try:
        found = calibration.getImuToCameraExtrinsics(dai.CameraBoardSocket.CAM_A)
    except RuntimeError:
        return None
    R = np.asarray(found, dtype=np.float64)[:3, :3]
    # A memory that was never written holds zeros.
    return R if np.abs(R @ R.T - np.eye(3)).max() < 1e-2 else None

"""What the factory's calibration of an OAK camera says, in the terms of the rig's file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def imu_to_camera(dai: Any, calibration: Any) -> Floats | None:
    """Return R_camera_imu (3, 3); None where the calibration does not hold it."""
    try:
        found = calibration.getImuToCameraExtrinsics(dai.CameraBoardSocket.CAM_A)
    except RuntimeError:
        return None
    R = np.asarray(found, dtype=np.float64)[:3, :3]
    # A memory that was never written holds zeros.
    return R if np.abs(R @ R.T - np.eye(3)).max() < 1e-2 else None

"""Pinhole model of a camera: focal lengths, optical axis and distortion, in pixels.

Camera frame: optical, x right, y down, z forward. Pixels have their centres at whole numbers.
Distortion is that of the OpenCV manual (camera calibration and 3D reconstruction): two tangential
and three radial coefficients, in the order k1 k2 p1 p2 k3.
"""

from dataclasses import dataclass
from math import isfinite, pi, tan

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Distortion = tuple[float, float, float, float, float]


_NONE: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Intrinsic parameters of a camera.

    fx_px, fy_px: focal lengths; cx_px, cy_px: principal point
    distortion: k1 k2 p1 p2 k3 of the OpenCV manual; all 0 without distortion
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: Distortion = _NONE

    def __post_init__(self) -> None:
        """Reject invalid focal lengths and distortion.

        Raises:
            ValueError: a focal length is not above 0, or a coefficient is not finite.
        """
        if not (self.fx_px > 0.0 and self.fy_px > 0.0):
            raise ValueError(f"focal lengths must be above 0, not {self.fx_px}, {self.fy_px}")
        if len(self.distortion) != 5 or not all(map(isfinite, self.distortion)):
            raise ValueError(f"distortion must be five finite numbers, not {self.distortion}")

    @property
    def has_distortion(self) -> bool:
        """Return whether straight lines are bent in its frames."""
        return any(self.distortion)

    @property
    def matrix(self) -> Floats:
        """Return the 3x3 camera matrix."""
        return np.array(
            [(self.fx_px, 0.0, self.cx_px), (0.0, self.fy_px, self.cy_px), (0.0, 0.0, 1.0)]
        )

    def scaled(self, factor_x: float, factor_y: float) -> "Intrinsics":
        """Return the intrinsics of the same frames scaled by these factors.

        Raises:
            ValueError: a factor is not above 0.
        """
        return Intrinsics(
            self.fx_px * factor_x,
            self.fy_px * factor_y,
            (self.cx_px + 0.5) * factor_x - 0.5,
            (self.cy_px + 0.5) * factor_y - 0.5,
            self.distortion,
        )


def intrinsics_of_view(view_rad: float, width_px: int, height_px: int) -> Intrinsics:
    """Return the intrinsics of square pixels with the optical axis at the centre of the frame.

    view_rad: field of view along the longer side, from edge to edge: that of a camera on its side
        is the same lens

    Raises:
        ValueError: the field of view is not between 0 and pi.
    """
    if not 0.0 < view_rad < pi:
        raise ValueError(f"a field of view must be between 0 and pi rad, not {view_rad}")
    focal_px = 0.5 * max(width_px, height_px) / tan(0.5 * view_rad)
    return Intrinsics(focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1))

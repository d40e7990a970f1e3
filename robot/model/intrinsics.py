"""The lens: directions in the camera frame to pixels and back, with distortion.

Camera frame: optical, x right, y down, z forward. Metres; pixels have their centres at
whole numbers. Distortion is that of the OpenCV manual (camera calibration and 3D
reconstruction): two tangential and three radial coefficients, in the order k1 k2 p1 p2 k3.
"""

from dataclasses import dataclass
from math import tan

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.robot.model.frames import LensParams

Floats = NDArray[np.float64]
Distortion = tuple[float, float, float, float, float]

_NONE: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
# Undistorting is a search; with strong lenses OpenCV's usual five rounds leave a pixel.
_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-10)
# Two sizes of picture show the same field if their shapes differ by no more than rounding.
_SAME_SHAPE = 0.01


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A camera.

    fx_px, fy_px: focal lengths; cx_px, cy_px: where the optical axis meets the picture
    distortion: k1 k2 p1 p2 k3 of the OpenCV manual; all 0 for a lens without
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: Distortion = _NONE

    def __post_init__(self) -> None:
        """Refuse focal lengths that are no lengths, and distortion that is no five numbers.

        Raises:
            ValueError: a focal length is not above 0, or a coefficient is not finite.
        """
        if not (self.fx_px > 0.0 and self.fy_px > 0.0):
            raise ValueError(f"focal lengths must be above 0, not {self.fx_px}, {self.fy_px}")
        if len(self.distortion) != 5 or not np.isfinite(self.distortion).all():
            raise ValueError(f"distortion is five finite numbers, not {self.distortion}")

    @property
    def distorts(self) -> bool:
        """Return whether straight lines become bent in its pictures."""
        return any(self.distortion)

    @property
    def matrix(self) -> Floats:
        """Return the 3x3 camera matrix."""
        return np.array(
            [(self.fx_px, 0.0, self.cx_px), (0.0, self.fy_px, self.cy_px), (0.0, 0.0, 1.0)]
        )

    def scaled(self, factor_x: float, factor_y: float) -> "Intrinsics":
        """Return the intrinsics of the same pictures made wider and higher by these factors.

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
    """Return the intrinsics of square pixels with the axis in the middle of the picture.

    view_rad: horizontal field of view, from edge to edge

    Raises:
        ValueError: the field of view is not between 0 and pi.
    """
    if not 0.0 < view_rad < np.pi:
        raise ValueError(f"a field of view lies between 0 and pi rad, not {view_rad}")
    focal_px = 0.5 * width_px / tan(0.5 * view_rad)
    return Intrinsics(focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1))


def intrinsics_of_lens(
    lens: LensParams | None, view_rad: float, width_px: int, height_px: int
) -> Intrinsics:
    """Return the intrinsics of pictures of a size, as measured where that can be told.

    Pictures of another size but the same shape are taken for the measured ones scaled.
    Of another shape it is unknown which edges the camera cut off, so the field of view
    has to do, as where nothing was measured.

    view_rad: horizontal field of view, from edge to edge
    """
    if lens is None or not fits(lens, width_px, height_px):
        return intrinsics_of_view(view_rad, width_px, height_px)
    measured = Intrinsics(lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion)
    return measured.scaled(width_px / lens.width_px, height_px / lens.height_px)


def fits(lens: LensParams, width_px: int, height_px: int) -> bool:
    """Return whether pictures of a size show the field that the lens was measured on."""
    if width_px <= 0 or height_px <= 0:
        return False
    shape = (width_px * lens.height_px) / (height_px * lens.width_px)
    return abs(shape - 1.0) <= _SAME_SHAPE


def project(points_camera_m: ArrayLike, intrinsics: Intrinsics) -> Floats:
    """Return where points (n, 3) appear: (n, 2) pixels, nan for points not before the camera."""
    p = np.asarray(points_camera_m, dtype=np.float64).reshape(-1, 3)
    z = np.where(p[:, 2:] > 0.0, p[:, 2:], np.nan)
    i = intrinsics
    plane = p[:, :2] / z
    if i.distorts:
        plane = _distorted(plane, i.distortion)
    pixels: Floats = plane * (i.fx_px, i.fy_px) + (i.cx_px, i.cy_px)
    return pixels


def rays(points_px: ArrayLike, intrinsics: Intrinsics) -> Floats:
    """Return the directions (n, 3) through pixels (n, 2), with z = 1 and distortion undone."""
    points = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
    i = intrinsics
    found = np.ones((len(points), 3))
    if i.distorts and len(points):
        flat = cv2.undistortPointsIter(
            points[:, None], i.matrix, np.array(i.distortion), np.eye(3), np.eye(3), _UNTIL
        )
        found[:, :2] = flat[:, 0]
    else:
        found[:, :2] = (points - (i.cx_px, i.cy_px)) / (i.fx_px, i.fy_px)
    return found


def undistorted(points_px: ArrayLike, intrinsics: Intrinsics) -> Floats:
    """Return where pixels (n, 2) would be if the lens did not distort."""
    i = intrinsics
    points: Floats = rays(points_px, i)[:, :2] * (i.fx_px, i.fy_px) + (i.cx_px, i.cy_px)
    return points


def _distorted(plane: Floats, distortion: Distortion) -> Floats:
    """Move points of the plane z = 1 as the lens does."""
    k1, k2, p1, p2, k3 = distortion
    x, y = plane[:, 0], plane[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    moved: Floats = np.stack(
        (
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ),
        axis=1,
    )
    return moved

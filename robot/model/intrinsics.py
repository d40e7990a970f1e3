"""Conversion between directions in the camera frame and pixels, with the best known lens data.

Camera frame: optical, x right, y down, z forward, in m. Pixels have their centres at whole
numbers. Distortion is that of the OpenCV manual (camera calibration and 3D reconstruction): two
tangential and three radial coefficients, in the order k1 k2 p1 p2 k3.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.robot.model.frames import LensParams

Floats = NDArray[np.float64]

# Two sizes of image show the same field if their shapes differ by no more than rounding.
_SAME_SHAPE = 0.01
# Largest distance of the optical axis from the middle, in widths and heights: a camera that uses
# a part of its sensor may have its axis near an edge of the image, or a little outside.
_FARTHEST_AXIS = 0.75


@lru_cache(maxsize=64)
def intrinsics_of_lens(
    lens: LensParams | None,
    view_rad: float,
    width_px: int,
    height_px: int,
    own: Intrinsics | None = None,
) -> Intrinsics:
    """Return the intrinsics of images of a size: measured, from the camera, or from the view.

    Images of another size with the same shape count as scaled measured ones. For another shape
    it is unknown which edges the camera has cut off, so the field of view is used, as without a
    measured lens (see ``lens_fault``).

    Args:
        lens: Measured lens.
        view_rad: Field of view along the longer side, from edge to edge.
        width_px: Width of the images.
        height_px: Height of the images.
        own: Intrinsics reported by the camera, used if no measured lens fits.
    """
    if lens is None or lens_fault(lens, width_px, height_px):
        if own is not None:
            return own
        return intrinsics_of_view(view_rad, width_px, height_px)
    measured = Intrinsics(*lens.focal_px, *lens.centre_px, lens.distortion)
    return measured.scaled(width_px / lens.size_px[0], height_px / lens.size_px[1])


def lens_fault(lens: LensParams, width_px: int, height_px: int) -> str:
    """Return the reason why a measured lens does not fit images of a size, "" if it does."""
    if width_px <= 0 or height_px <= 0:
        return f"images are {width_px} x {height_px}"
    (wide, high), (x, y) = lens.size_px, lens.centre_px
    if abs((width_px * high) / (height_px * wide) - 1.0) > _SAME_SHAPE:
        return f"it was measured on {wide} x {high}, images are {width_px} x {height_px}"
    if max(abs(x / wide - 0.5), abs(y / high - 0.5)) > _FARTHEST_AXIS:
        return f"its axis at {x:g}, {y:g} px is far outside images of {wide} x {high}"
    return ""


def project(points_camera_m: ArrayLike, intrinsics: Intrinsics) -> Floats:
    """Project points (n, 3) to pixels (n, 2), NaN for points not in front of the camera."""
    p = np.asarray(points_camera_m, dtype=np.float64).reshape(-1, 3)
    z = np.where(p[:, 2:] > 0.0, p[:, 2:], np.nan)
    i = intrinsics
    plane = p[:, :2] / z
    if i.has_distortion:
        import cv2

        ahead, none = np.column_stack((plane, np.ones(len(p)))), np.zeros(3)
        bent = cv2.projectPoints(ahead, none, none, np.eye(3), np.array(i.distortion))[0]
        plane = bent[:, 0].astype(np.float64)
    pixels: Floats = plane * (i.fx_px, i.fy_px) + (i.cx_px, i.cy_px)
    return pixels


def rays(points_px: ArrayLike, intrinsics: Intrinsics) -> Floats:
    """Return the undistorted directions (n, 3) through pixels (n, 2), with z = 1."""
    x, y = np.asarray(points_px, dtype=np.float64).reshape(-1, 2).T
    i = intrinsics
    found = np.ones((len(x), 3))
    found[:, 0], found[:, 1] = (x - i.cx_px) / i.fx_px, (y - i.cy_px) / i.fy_px
    if i.has_distortion and x.size:
        import cv2

        # With strong lenses the usual five rounds leave an error of a pixel.
        rounds = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-12)
        found[:, :2] = cv2.undistortPointsIter(
            found[:, None, :2], np.eye(3), np.array(i.distortion), np.eye(3), np.eye(3), rounds
        )[:, 0]
    return found

"""Lens calibration from views of the board: focal lengths, centre, distortion, and uncertainties.

Pure. Zhang's method and its refinement are OpenCV's (manual, cv2.calibrateCameraExtended), without
the third radial coefficient, which ordinary lenses do not need and few views do not determine. This
module drops views that do not fit, and refuses results that are not good enough.
"""

from collections.abc import Sequence
from math import degrees
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import SetupError
from gazerig.drivers.vision.charuco_board import DetectedBoard
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import rays

Floats = NDArray[np.float64]

WIDTH_PX = 640
"""Limits in pixels are for images of this width and scale with it."""
MOST_ERROR_PX = 0.7
"""Largest root mean square reprojection error."""
MOST_FOCAL_PERCENT = 0.2

# A view so many times worse than the usual one is dropped, but never a good one, and at most one
# view in five: if more do not fit, the others are at fault.
_OUTLIER, _GOOD_PX, _LEAST_KEPT = 2.5, 0.25, 0.8


class CameraCalibrationRefused(SetupError):
    """Refusal of a camera calibration; the message has the reason and the remedy."""


class LensCalibration(NamedTuple):
    """A measured lens.

    rms_px: root mean square reprojection error of all corners; view_rms_px: of each kept view
    std_px: standard deviations of fx, fy, cx and cy
    dropped: number of views that did not fit
    """

    intrinsics: Intrinsics
    rms_px: float
    view_rms_px: Floats
    std_px: Floats
    dropped: int = 0


def calibrate_lens(
    views: Sequence[DetectedBoard],
    width_px: int,
    height_px: int,
    most_focal_percent: float = MOST_FOCAL_PERCENT,
) -> LensCalibration:
    """Find the lens that explains all views.

    most_focal_percent: largest standard deviation of the focal length

    Raises:
        CameraCalibrationRefused: the result is not good or not certain enough.
    """
    kept = list(views)
    fit = _fit(kept, width_px, height_px)
    while len(kept) - 1 >= _LEAST_KEPT * len(views):
        worst = int(np.argmax(fit.view_rms_px))
        usual = float(np.median(fit.view_rms_px))
        if fit.view_rms_px[worst] <= max(_OUTLIER * usual, _GOOD_PX):
            break
        del kept[worst]
        fit = _fit(kept, width_px, height_px)
    most_px = MOST_ERROR_PX * width_px / WIDTH_PX
    if not fit.rms_px <= most_px:
        raise CameraCalibrationRefused(
            f"reprojection error {fit.rms_px:.2f} px, wanted at most {most_px:.2f}: see that the "
            "board is flat, the light bright and the camera in focus with its focus fixed"
        )
    sure = float(fit.std_px[:2].max()) / fit.intrinsics.fx_px * 100.0
    if not sure <= most_focal_percent:
        raise CameraCalibrationRefused(
            f"the focal length is sure to {sure:.2f} % only, wanted is "
            f"{most_focal_percent:g} %: show more views with the board tilted"
        )
    return fit._replace(dropped=len(views) - len(kept))


def _fit(views: Sequence[DetectedBoard], width: int, height: int) -> LensCalibration:
    """Run OpenCV's calibration."""
    points = [view.corners_board_m.astype(np.float32)[:, None] for view in views]
    corners = [view.corners_px.astype(np.float32)[:, None] for view in views]
    try:
        rms, matrix, bends, _, _, spreads, _, view_rms = cv2.calibrateCameraExtended(
            points, corners, (width, height), np.eye(3), np.zeros(5), flags=cv2.CALIB_FIX_K3
        )
        (fx, _, cx), (_, fy, cy), _ = np.asarray(matrix).tolist()
        k1, k2, p1, p2, k3 = np.ravel(bends)[:5].tolist()
        lens = Intrinsics(fx, fy, cx, cy, (k1, k2, p1, p2, k3))
    except (cv2.error, ValueError) as error:
        raise CameraCalibrationRefused(
            "no lens explains these views: see that the board is flat and is the one printed, and "
            "start again"
        ) from error
    errors, std = np.ravel(view_rms).astype(np.float64), np.ravel(spreads)[:4].astype(np.float64)
    return LensCalibration(lens, float(rms), errors, std)


def lens_params(lens: Intrinsics, width_px: int, height_px: int) -> LensParams:
    """Return a lens in the format of the rig's file."""
    fx, fy, cx, cy = (round(px, 2) for px in (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px))
    k1, k2, p1, p2, k3 = (round(k, 6) + 0.0 for k in lens.distortion)
    return LensParams((width_px, height_px), (fx, fy), (cx, cy), (k1, k2, p1, p2, k3))


def field_deg(lens: Intrinsics, width_px: int, height_px: int) -> float:
    """Return the field of view along the longer side, through the optical axis."""
    longer = int(height_px > width_px)
    edges = np.array([(lens.cx_px, lens.cy_px)] * 2)
    edges[:, longer] = -0.5, max(width_px, height_px) - 0.5
    first, last = np.arctan(rays(edges, lens)[:, longer]).tolist()
    return degrees(last - first)

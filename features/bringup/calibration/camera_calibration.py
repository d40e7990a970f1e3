"""Lens calibration from views of the board: focal lengths, centre, distortion, and uncertainties.

Pure. Zhang's method and its refinement are OpenCV's (manual, cv2.calibrateCameraExtended). This
module adds the refusal of unsuitable views and results.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan, degrees, inf
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.charuco_views import ViewCollector, ViewParams
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import DetectedBoard
from gazerig.robot.model.frames import LensParams
from gazerig.robot.model.intrinsics import project, rays

Floats = NDArray[np.float64]

# Limits in pixels are for images of this width and scale with the width.
_WIDTH_PX = 640
# The third radial coefficient is kept if it is this many times its spread.
_PROVEN = 4.0
# A view with an error up to this is never an outlier.
_GOOD_PX = 0.25
# At most one view in five is dropped; if more do not fit, the others are at fault.
_MOST_DROPPED = 0.2


class CameraCalibrationRefused(SetupError):
    """Refusal of a camera calibration; the message has the reason and the remedy."""


@dataclass(frozen=True)
class LensCalibrationParams:
    """Limits of an acceptable result."""

    # fmt: off
    most_error_px: Annotated[float, Bounds(0.05, 20),
        "root mean square reprojection error above which the result is refused, in images 640 px wide"] = 0.7
    most_focal_error_percent: Annotated[float, Bounds(0.01, 20),
        "standard deviation of the focal length above which the result is refused"] = 0.2
    outlier_ratio: Annotated[float, Bounds(1.2, 100), "a view so many times worse than the usual one is dropped"] = 2.5
    views: Annotated[ViewParams, "how many views, how different"] = field(default_factory=ViewParams)
    # fmt: on


@dataclass(frozen=True, slots=True)
class LensCalibration:
    """A measured lens.

    width_px, height_px: size of the frames of the measurement
    rms_px: root mean square reprojection error of all corners; view_rms_px: of each kept view
    kept, dropped: numbers of the input views, from 0
    focal_std_px, centre_std_px: standard deviations of fx, fy and of cx, cy
    """

    intrinsics: Intrinsics
    width_px: int
    height_px: int
    rms_px: float
    view_rms_px: tuple[float, ...]
    kept: tuple[int, ...]
    dropped: tuple[int, ...]
    focal_std_px: tuple[float, float]
    centre_std_px: tuple[float, float]

    @property
    def horizontal_field_deg(self) -> float:
        """Return the field of view along the longer side, through the optical axis."""
        lens, longer = self.intrinsics, int(self.height_px > self.width_px)
        edges = np.array([(lens.cx_px, lens.cy_px)] * 2)
        edges[:, longer] = -0.5, max(self.width_px, self.height_px) - 0.5
        first, last = rays(edges, lens)[:, longer].tolist()
        return degrees(atan(last) - atan(first))

    def params(self) -> LensParams:
        """Return the lens in the format of the rig's file."""
        return lens_params(self.intrinsics, self.width_px, self.height_px)


def lens_params(lens: Intrinsics, width_px: int, height_px: int) -> LensParams:
    """Return a lens in the format of the rig's file."""
    fx, fy, cx, cy = (round(px, 2) for px in (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px))
    k1, k2, p1, p2, k3 = (round(k, 6) + 0.0 for k in lens.distortion)
    return LensParams((width_px, height_px), (fx, fy), (cx, cy), (k1, k2, p1, p2, k3))


class _Fit(NamedTuple):
    """OpenCV's calibration for a set of views."""

    lens: Intrinsics
    rms_px: float
    view_rms_px: Floats
    std: Floats


def calibrate_lens(
    views: Sequence[DetectedBoard],
    guess: Intrinsics,
    width_px: int,
    height_px: int,
    params: LensCalibrationParams | None = None,
) -> LensCalibration:
    """Find the lens that explains all views.

    guess: an approximate lens, for the comparison of views

    Raises:
        CameraCalibrationRefused: the views are too few or too similar (names the missing ones), or
            the result is not good or not certain enough.
    """
    par = params if params is not None else LensCalibrationParams()
    usable = _usable(views, guess, width_px, height_px, par.views)
    kept = list(usable)
    fit = _fit(views, kept, width_px, height_px)
    while (worst := outlier(fit.view_rms_px, par.outlier_ratio, _GOOD_PX)) is not None:
        if len(kept) <= max(par.views.least_views, (1.0 - _MOST_DROPPED) * len(usable)):
            break
        del kept[worst]
        fit = _fit(views, kept, width_px, height_px)
    # The views without the outliers must still cover the lens.
    _usable([views[k] for k in kept], guess, width_px, height_px, par.views)
    _judge(fit, width_px, height_px, par)
    fx, fy, cx, cy = fit.std[:4].tolist()
    return LensCalibration(
        fit.lens,
        width_px,
        height_px,
        fit.rms_px,
        tuple(fit.view_rms_px.tolist()),
        tuple(kept),
        tuple(k for k in range(len(views)) if k not in kept),
        (fx, fy),
        (cx, cy),
    )


def _usable(
    views: Sequence[DetectedBoard], guess: Intrinsics, width: int, height: int, params: ViewParams
) -> list[int]:
    """Return the numbers of the views that add information; refuse if they are too few."""
    collector = ViewCollector(guess, width, height, params)
    usable = [k for k, seen in enumerate(views) if not collector.offer(seen)]
    if not collector.coverage.enough:
        alike = len(views) - len(usable)
        raise CameraCalibrationRefused(
            f"{len(views)} views, {alike} of them too much like others, do not show the lens: "
            + "; ".join(collector.coverage.missing)
        )
    return usable


def _fit(views: Sequence[DetectedBoard], kept: Sequence[int], width: int, height: int) -> _Fit:
    """Fit a lens; with the third radial coefficient if the views prove it."""
    plain = _run_opencv([views[k] for k in kept], width, height, cv2.CALIB_FIX_K3)
    full = _run_opencv([views[k] for k in kept], width, height, 0)
    k3, spread = full.lens.distortion[4], float(full.std[8])
    proven = abs(k3) > _PROVEN * spread and full.rms_px < 0.98 * plain.rms_px
    return full if proven and not _folds(full.lens, width, height) else plain


def _run_opencv(views: Sequence[DetectedBoard], width: int, height: int, flags: int) -> _Fit:
    """Run OpenCV's calibration."""
    points = [view.corners_board_m.astype(np.float32)[:, None] for view in views]
    corners = [view.corners_px.astype(np.float32)[:, None] for view in views]
    try:
        rms, matrix, bends, _, _, spreads, _, view_rms = cv2.calibrateCameraExtended(
            points, corners, (width, height), np.eye(3), np.zeros(5), flags=flags
        )
        k1, k2, p1, p2, k3 = np.ravel(bends)[:5].tolist()
        lens = Intrinsics(
            float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2]),
            (k1, k2, p1, p2, k3),
        )  # fmt: skip
    except (cv2.error, ValueError) as error:
        raise CameraCalibrationRefused(
            "no lens explains these views: see that the board is flat and is the one printed "
            "(columns, rows), and start again"
        ) from error
    return _Fit(lens, float(rms), np.ravel(view_rms), np.ravel(spreads))


def outlier(view_rms_px: Floats, ratio: float, good_px: float) -> int | None:
    """Return the view with the largest error if that is much larger than the median.

    ratio: limit of error over median; good_px: a view with a smaller error is not an outlier
    """
    worst = int(np.argmax(view_rms_px))
    usual = float(np.median(view_rms_px))
    return worst if view_rms_px[worst] > max(ratio * usual, good_px) else None


def _judge(fit: _Fit, width: int, height: int, params: LensCalibrationParams) -> None:
    """Refuse a fit with too large errors or standard deviations."""
    most_px = params.most_error_px * width / _WIDTH_PX
    if not fit.rms_px <= most_px:
        raise CameraCalibrationRefused(
            f"reprojection error {fit.rms_px:.2f} px, wanted at most {most_px:.2f}: see that the "
            "board is flat, the light bright and the camera in focus with its focus fixed"
        )
    focal = 0.5 * (fit.lens.fx_px + fit.lens.fy_px)
    sure = max(fit.std[0], fit.std[1]) / focal * 100.0 if np.isfinite(fit.std[:4]).all() else inf
    if not sure <= params.most_focal_error_percent:
        raise CameraCalibrationRefused(
            f"the focal length is sure to {sure:.2f} % only, wanted is "
            f"{params.most_focal_error_percent:g} %: show more views with the board tilted"
        )
    if _folds(fit.lens, width, height):
        raise CameraCalibrationRefused(
            "the distortion found makes no sense in the image's corners: bring the board "
            "into the corners as well"
        )


def _folds(lens: Intrinsics, width: int, height: int) -> bool:
    """Return whether a pixel near the image's edge has two directions or none."""
    x, y = np.linspace(0.0, width - 1.0, 9), np.linspace(0.0, height - 1.0, 9)
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    back = project(rays(pixels, lens), lens)
    return not bool(np.abs(back - pixels).max() < 0.1)

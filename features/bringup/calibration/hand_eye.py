"""Place of the camera on the head, from one fixed board seen at several neck angles. Pure.

Hand-eye calibration, AX = XB: the joints measure how the head moves, the camera sees how
the board seems to move, and only one place of the camera on the head makes both
agree. OpenCV's closed forms (manual, cv2.calibrateHandEye) start the search; they trust
every single pose of the board, whose tilt is poorly seen, so the answer is the place of
camera and board that brings all corners of all frames nearest to where they are seen.
Frames as in gazerig.robot.model.frames; the board's as in gazerig.robot.model.charuco_board.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, inf, radians
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.features.bringup.calibration.camera_calibration import (
    CameraCalibrationRefused,
    outlier,
)
from gazerig.features.bringup.calibration.charuco_views import board_poses
from gazerig.features.bringup.calibration.hand_eye_solver import (
    Fit,
    Observations,
    Pose,
    first_estimate,
    refine,
)
from gazerig.gaze.types import Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import SeenBoard
from gazerig.robot.model.frames import CameraParams, mounted_at

Floats = NDArray[np.float64]

_METHODS = (
    cv2.CALIB_HAND_EYE_PARK,
    cv2.CALIB_HAND_EYE_DANIILIDIS,
    cv2.CALIB_HAND_EYE_TSAI,
    cv2.CALIB_HAND_EYE_HORAUD,
)
_MOST_DROPPED = 0.2
# Limits in pixels are for images of this width and grow with it.
_WIDTH_PX = 640
# A search that ends worse than this is tried from the other starts too.
_DOUBTFUL_PX = 1.0
# No view is an outlier that is as good as this.
_GOOD_PX = 0.5
# No joint is trusted beyond a quarter of a servo step.
_BEST_JOINT_DEG = 0.02


@dataclass(frozen=True)
class HandEyeParams:
    """Limits of an acceptable result."""

    # fmt: off
    least_views: Annotated[int, Bounds(3, 200), "fewer are refused"] = 8
    least_turn_deg: Annotated[float, Bounds(0.5, 60),
        "root mean square turn of the head from view to view that is needed about a second axis"] = 4.0
    most_error_px: Annotated[float, Bounds(0.1, 50),
        "root mean square reprojection error above which the result is refused, in images 640 px wide"] = 5.0
    most_position_std_mm: Annotated[float, Bounds(0.1, 100), "standard deviation of the place above which the result is refused"] = 5.0
    most_angle_std_deg: Annotated[float, Bounds(0.01, 20), "standard deviation of the direction above which the result is refused"] = 0.6
    joint_error_deg: Annotated[float, Bounds(0.001, 5), "how far a neck joint usually is from where it says: steps, play"] = 0.15
    lens_error_percent: Annotated[float, Bounds(0.0001, 10), "how far the calibrated focal length usually is from the true one"] = 0.15
    centre_error_px: Annotated[float, Bounds(0.0001, 100),
        "how far the calibrated centre usually is from the true one, in images 640 px wide"] = 1.0
    outlier_ratio: Annotated[float, Bounds(1.2, 100), "a view so many times worse than the usual one is dropped"] = 3.0
    # fmt: on


class NeckView(NamedTuple):
    """The head's pose while a frame was taken, and the board in it."""

    R_world_head: Mat3
    p_world_head_m: Vec3
    seen: SeenBoard


@dataclass(frozen=True, slots=True)
class HandEye:
    """A camera found on the head.

    R_head_camera, p_head_camera_m: its pose in the head
    R_world_board, p_world_board_m: pose of the board, by the same fit
    lens: as given, with focal length and centre touched up by the same fit; it belongs to
        this place of the camera
    rms_px: root mean square reprojection error, joints taken at their word; view_rms_px: of
        each view kept
    corner_px: what is left of it when every neck joint may be off a little
    joint_error_deg: root mean square of how far they would have to be off
    kept, dropped: numbers of the views given, from 0
    position_std_mm: standard deviation of each coordinate, from how views and lens bear on it
    angle_std_deg: standard deviation about the camera's x, y and z axis, found likewise;
        what the rig's geometry is off is in neither
    """

    R_head_camera: Mat3
    p_head_camera_m: Vec3
    R_world_board: Mat3
    p_world_board_m: Vec3
    lens: Intrinsics
    rms_px: float
    view_rms_px: tuple[float, ...]
    corner_px: float
    joint_error_deg: float
    kept: tuple[int, ...]
    dropped: tuple[int, ...]
    position_std_mm: Vec3
    angle_std_deg: Vec3

    def camera_params(self, params: CameraParams) -> CameraParams:
        """Return the camera at the place found, rounded to 0.1 mm and 0.01 deg."""
        found = mounted_at(params, self.R_head_camera, self.p_head_camera_m)
        x, y, z = (round(mm, 1) for mm in found.position_mm)
        return replace(
            found,
            mount="head",
            position_mm=(x, y, z),
            yaw_deg=round(found.yaw_deg, 2),
            pitch_deg=round(found.pitch_deg, 2),
            roll_deg=round(found.roll_deg, 2),
        )


def camera_on_head(
    views: Sequence[NeckView],
    lens: Intrinsics,
    width_px: int,
    params: HandEyeParams | None = None,
) -> HandEye:
    """Find the place of the camera on the head.

    width_px: of the frames; limits in pixels grow with it

    Raises:
        CameraCalibrationRefused: too few views, turns about one axis only, or the result is
            not good or not sure enough.
    """
    par = params if params is not None else HandEyeParams()
    if len(views) < par.least_views:
        raise CameraCalibrationRefused(
            f"the board was seen from {len(views)} neck angles, wanted are {par.least_views}: hang "
            "it where the camera sees all of it while the head looks straight ahead, in good light"
        )
    _refuse_parallel([view.R_world_head for view in views], par)
    kept = list(range(len(views)))
    fit = _fit(views, lens, width_px, par)
    while (worst := outlier(fit.view_rms_px, par.outlier_ratio, _GOOD_PX)) is not None:
        if len(kept) <= max(par.least_views, (1.0 - _MOST_DROPPED) * len(views)):
            break
        del kept[worst]
        fit = _fit([views[k] for k in kept], lens, width_px, par)
    _refuse_parallel([views[k].R_world_head for k in kept], par)
    _judge(fit, par, width_px)
    spread = fit.spread()
    return HandEye(
        _mat3(fit.estimate.camera.R),
        _vec3(fit.estimate.camera.p),
        _mat3(fit.estimate.board.R),
        _vec3(fit.estimate.board.p),
        fit.estimate.lens(lens),
        fit.rms_px,
        tuple(fit.view_rms_px.tolist()),
        fit.corner_px,
        fit.joint_error_deg,
        tuple(kept),
        tuple(k for k in range(len(views)) if k not in kept),
        _vec3(spread[3:6] * 1e3),
        _vec3(np.degrees(spread[:3])),
    )


def turns_deg(R_world_head: Sequence[Mat3]) -> tuple[float, float]:
    """Return the root mean square turn between any two poses about the main axis and the second.

    If the second is 0, the head turned about one axis only, and the place of the camera
    along it is unknown.
    """
    R = np.array(R_world_head)
    turns = [
        cv2.Rodrigues(R[i].T @ R[j])[0][:, 0] for i in range(len(R)) for j in range(i + 1, len(R))
    ]
    if not turns:
        return 0.0, 0.0
    moments = np.linalg.eigvalsh(np.einsum("ni,nj->ij", turns, turns) / len(turns))
    _, second, main = np.sqrt(np.clip(moments, 0.0, None)).tolist()
    return degrees(main), degrees(second)


def _refuse_parallel(R_world_head: Sequence[Mat3], params: HandEyeParams) -> None:
    main, second = turns_deg(R_world_head)
    if second < params.least_turn_deg:
        raise CameraCalibrationRefused(
            f"the head turned by {main:.1f} deg about one axis and only by {second:.1f} deg about "
            f"any other, wanted are {params.least_turn_deg:g}: turn it to the sides and let it "
            "nod or roll as well"
        )


def _judge(fit: Fit, params: HandEyeParams, width_px: int) -> None:
    """Refuse a fit with too large errors or standard deviations."""
    most_px = params.most_error_px * width_px / _WIDTH_PX
    if not fit.rms_px <= most_px:
        raise CameraCalibrationRefused(
            f"reprojection error {fit.rms_px:.2f} px, wanted at most {most_px:.2f}: see that the "
            "board hangs still, the lens is calibrated at this image size, and the neck "
            "joints' zeros and signs and the rig's geometry are right"
        )
    spread = fit.spread()
    mm = float(spread[3:6].max()) * 1e3 if np.isfinite(spread).all() else inf
    deg = degrees(float(spread[:3].max())) if np.isfinite(spread).all() else inf
    if not (mm <= params.most_position_std_mm and deg <= params.most_angle_std_deg):
        raise CameraCalibrationRefused(
            f"the camera's place is sure to {mm:.1f} mm and {deg:.2f} deg only, wanted are "
            f"{params.most_position_std_mm:g} mm and {params.most_angle_std_deg:g} deg: turn the "
            "head farther, hang the board nearer, or take more views"
        )


def _fit(views: Sequence[NeckView], lens: Intrinsics, width_px: int, params: HandEyeParams) -> Fit:
    """Refine the start that explains the frames best."""
    centre_px = params.centre_error_px * width_px / _WIDTH_PX
    observations = Observations.of(
        [(v.R_world_head, v.p_world_head_m, v.seen) for v in views],
        lens,
        np.array((params.lens_error_percent / 100.0, centre_px, centre_px)),
        radians(params.joint_error_deg),
    )
    starts = sorted(_starts(views, lens), key=lambda found: _median_error_px(observations, *found))
    if not starts:
        raise CameraCalibrationRefused(
            "the images of the board do not agree with any place of the camera: see that "
            "board, lens and joints are the ones calibrated"
        )
    best = refine(observations, first_estimate(observations, *starts[0]))
    if not best.corner_px < _DOUBTFUL_PX:
        others = [
            refine(observations, first_estimate(observations, *other)) for other in starts[1:]
        ]
        best = min((best, *others), key=lambda fit: fit.cost)
    # Joints that proved better than usual are trusted more.
    proven = min(max(best.joint_error_deg, _BEST_JOINT_DEG), params.joint_error_deg)
    return refine(observations._replace(joint_error_rad=radians(proven)), best.estimate)


def _starts(views: Sequence[NeckView], lens: Intrinsics) -> list[tuple[Pose, Pose]]:
    """Return places of camera and board by OpenCV's closed forms, those that are any."""
    posed = [(view, poses[0]) for view in views if (poses := board_poses(view.seen, lens))]
    if len(posed) < 3:
        return []
    heads = [Pose(np.array(v.R_world_head), np.array(v.p_world_head_m)) for v, _ in posed]
    boards = [Pose(pose.R_camera_board, pose.p_camera_board_m) for _, pose in posed]
    found = []
    for method in _METHODS:
        try:
            R, p = cv2.calibrateHandEye(
                [h.R for h in heads], [h.p for h in heads],
                [b.R for b in boards], [b.p for b in boards], method=method,
            )  # fmt: skip
        except cv2.error:
            continue
        camera = Pose(np.asarray(R, dtype=np.float64), np.ravel(p).astype(np.float64))
        if np.isfinite(camera.R).all() and np.isfinite(camera.p).all():
            hung = [h.then(camera).then(b) for h, b in zip(heads, boards, strict=True)]
            found.append((camera, _middle(hung)))
    return found


def _median_error_px(observations: Observations, camera: Pose, board: Pose) -> float:
    """Return the usual reprojection error of a start, by which starts are compared."""
    errors = np.abs(observations.errors(first_estimate(observations, camera, board)))
    return float(np.median(np.where(np.isfinite(errors), errors, inf)))


def _middle(poses: Sequence[Pose]) -> Pose:
    """Return the pose in the middle of several: median place, mean rotation."""
    u, _, vt = np.linalg.svd(np.sum([pose.R for pose in poses], axis=0))
    R = u @ np.diag((1.0, 1.0, np.linalg.det(u @ vt))) @ vt
    return Pose(R, np.median([pose.p for pose in poses], axis=0))


def _vec3(row: Floats) -> Vec3:
    x, y, z = row.tolist()
    return x, y, z


def _mat3(R: Floats) -> Mat3:
    return _vec3(R[0]), _vec3(R[1]), _vec3(R[2])

"""Pose of the camera on the head, from one fixed board seen at several neck angles. Pure.

Hand-eye calibration, AX = XB: the joints measure the motion of the head, the camera measures the
apparent motion of the board, and only one pose of the camera on the head makes both agree. OpenCV's
closed forms (manual, cv2.calibrateHandEye) are the start of the search. They rely on each single
pose of the board, whose tilt is measured inaccurately. So the result is the pose of camera and
board that reprojects all corners of all frames best. Outlying corners have less weight (Huber).
Joint sensors are not exact (steps of 0.088 deg, play of the gears), and an error of 0.1 deg of the
head shifts a board at 0.7 m by more than all errors of its corners. So each view also has a small
rotation of the head as an unknown, with the usual joint error as prior. The lens is not known
exactly either: 1 % of its focal length is 7 mm of the camera's position. But a head that turns by
known angles also measures the lens, so focal length and centre may change within the usual error of
a calibration. The standard deviations follow from omitting one view at a time (jackknife), and from
the dependence of the pose on the lens. Frames as in gazerig.robot.model.frames; the board's as in
gazerig.robot.model.charuco_board.
"""

from collections.abc import Callable, Sequence
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
from gazerig.gaze.types import Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import DetectedBoard
from gazerig.robot.model.frames import CameraParams, camera_at_pose
from gazerig.robot.model.intrinsics import project

Floats = NDArray[np.float64]

# Steps for slopes by differences: radians, metres.
_SMALL = 1e-6
_MOST_STEPS = 60
# The bound of Huber follows the errors of the previous round.
_ROUNDS = 4
# A last step of 1 um, or 0.00006 deg.
_SETTLED = 1e-6
# Unknowns that all views share: camera, board, and focal length and centre of the lens.
_SHARED = 15
# Usual error of a corner; only its ratio to the joints' error matters.
_CORNER_PX = 0.3
# Huber's bound relative to the spread of the errors: 95 % efficiency for normal noise.
_HUBER = 1.345


class Pose(NamedTuple):
    """Pose of a frame in its parent: rotation (3, 3) and position (3,) in metres."""

    R: Floats
    p: Floats

    def then(self, child: "Pose") -> "Pose":
        """Return the child's frame in this one's parent."""
        return Pose(self.R @ child.R, self.R @ child.p + self.p)

    def displace(self, step: Floats) -> "Pose":
        """Rotate it about its own axes and shift it along its parent's."""
        return Pose(self.R @ np.asarray(cv2.Rodrigues(step[:3])[0]), self.p + step[3:])


class Estimate(NamedTuple):
    """Unknowns of the fit.

    camera: pose in the head; board: pose in the world
    lens_off: (3,) deviation from the calibrated lens: relative increase of the focal length, and
        shift of the centre to the right and down in pixels
    turns_rad: (views, 3) rotation of the head in each view beyond the measured joint angles
    """

    camera: Pose
    board: Pose
    lens_off: Floats
    turns_rad: Floats

    def displace(self, step: Floats) -> "Estimate":
        """Return the estimate moved by (15 + 3 views,) numbers."""
        return Estimate(
            self.camera.displace(step[:6]),
            self.board.displace(step[6:12]),
            self.lens_off + step[12:_SHARED],
            self.turns_rad + step[_SHARED:].reshape(-1, 3),
        )

    def lens(self, calibrated: Intrinsics) -> Intrinsics:
        """Return the lens of this estimate."""
        zoom, right, down = self.lens_off.tolist()
        return Intrinsics(
            calibrated.fx_px * (1.0 + zoom),
            calibrated.fy_px * (1.0 + zoom),
            calibrated.cx_px + right,
            calibrated.cy_px + down,
            calibrated.distortion,
        )


class Observations(NamedTuple):
    """Observations of all corners in all views: n corners.

    R_world_head: (n, 3, 3); p_world_head_m, corners_board_m: (n, 3); corners_px: (n, 2)
    view: (n,) number of each corner's view; views: number of views
    lens_error: (3,) usual errors of focal length (relative) and centre (pixels)
    joint_error_rad: usual error of joints
    """

    R_world_head: Floats
    p_world_head_m: Floats
    corners_board_m: Floats
    corners_px: Floats
    view: NDArray[np.int64]
    views: int
    lens: Intrinsics
    lens_error: Floats
    joint_error_rad: float

    @staticmethod
    def of(
        views: Sequence[tuple[Mat3, Vec3, DetectedBoard]],
        lens: Intrinsics,
        lens_error: Floats,
        joint_error_rad: float,
    ) -> "Observations":
        """Return the observations of all views."""
        counts = [len(seen.ids) for _, _, seen in views]
        return Observations(
            np.repeat(np.array([R for R, _, _ in views]), counts, axis=0),
            np.repeat(np.array([p for _, p, _ in views]), counts, axis=0),
            np.concatenate([seen.corners_board_m for _, _, seen in views]),
            np.concatenate([seen.corners_px for _, _, seen in views]),
            np.repeat(np.arange(len(views)), counts),
            len(views),
            lens,
            lens_error,
            joint_error_rad,
        )

    def errors(self, estimate: Estimate) -> Floats:
        """Return the reprojection error of each corner: (2 n,) pixels, nan behind the camera."""
        world = self.corners_board_m @ estimate.board.R.T + estimate.board.p
        head = np.einsum("nji,nj->ni", self.R_world_head, world - self.p_world_head_m)
        # The rotations are so small that their squares are negligible.
        head -= np.cross(estimate.turns_rad[self.view], head)
        shown = project((head - estimate.camera.p) @ estimate.camera.R, estimate.lens(self.lens))
        return np.asarray((shown - self.corners_px).ravel(), dtype=np.float64)

    def slopes(self, estimate: Estimate) -> tuple[Floats, Floats]:
        """Return the derivatives of errors by shared unknowns (2 n, 15) and rotations (2 n, 3)."""
        columns = []
        for k in range(_SHARED + 3):
            step = np.zeros(_SHARED + 3 * self.views)
            step[[k] if k < _SHARED else slice(k, None, 3)] = _SMALL
            more, less = (self.errors(estimate.displace(sign * step)) for sign in (1.0, -1.0))
            columns.append((more - less) / (2.0 * _SMALL))
        return np.stack(columns[:_SHARED], axis=1), np.stack(columns[_SHARED:], axis=1)

    def residuals(self, estimate: Estimate) -> Floats:
        """Return errors of corners, lens and rotations, each relative to its usual error."""
        off = np.concatenate((estimate.lens_off, estimate.turns_rad.ravel())) / self._usual_errors()
        return np.concatenate((self.errors(estimate) / _CORNER_PX, off))

    def jacobian(self, estimate: Estimate) -> Floats:
        """Return the Jacobian of ``residuals``: (2 n + 3 + 3 views, 15 + 3 views)."""
        shared, own = self.slopes(estimate)
        rows, columns = len(shared), _SHARED + 3 * self.views
        slopes = np.zeros((rows + columns - 12, columns))
        slopes[:rows, :_SHARED] = shared / _CORNER_PX
        at = _SHARED + 3 * np.repeat(self.view, 2)
        for k in range(3):
            slopes[np.arange(rows), at + k] = own[:, k] / _CORNER_PX
        slopes[rows:, 12:] = np.diag(1.0 / self._usual_errors())
        return slopes

    def _usual_errors(self) -> Floats:
        """Return the usual errors of lens and joints: (3 + 3 views,)."""
        return np.concatenate((self.lens_error, np.full(3 * self.views, self.joint_error_rad)))


@dataclass(frozen=True)
class Fit:
    """Result of the fit.

    cost: minimised cost
    rms_px, view_rms_px: reprojection errors with the measured joint angles
    corner_px: remaining error with the estimated rotations of the head
    joint_error_deg: root mean square of those rotations, per joint
    """

    observations: Observations
    estimate: Estimate
    cost: float
    rms_px: float
    view_rms_px: Floats
    corner_px: float
    joint_error_deg: float

    def spread(self) -> Floats:
        """Return standard deviations (6,) of the camera's rotation (rad) and position (m)."""
        observations, errors = self.observations, self.observations.errors(self.estimate)
        shared, own = observations.slopes(self.estimate)
        weight = np.minimum(1.0, _bound(errors) / np.maximum(np.abs(errors), 1e-12))
        weight, of_row = weight / _CORNER_PX**2, np.repeat(observations.view, 2)
        inner = np.zeros((observations.views, _SHARED, _SHARED))
        pull = np.zeros((observations.views, _SHARED))
        for k in range(observations.views):
            mine = of_row == k
            a, b, w = shared[mine], own[mine], weight[mine, None]
            free = b.T @ (b * w) + np.eye(3) / observations.joint_error_rad**2
            across = a.T @ (b * w)
            inner[k] = a.T @ (a * w) - across @ np.linalg.solve(free, across.T)
            pull[k] = a.T @ (errors[mine] * weight[mine])
        try:
            # Distance of the best pose without view k from the best pose with all views.
            whole = inner.sum(axis=0)
            whole[12:, 12:] += np.diag(1.0 / observations.lens_error**2)
            off = np.linalg.solve(whole - inner, pull[:, :, None])[:, :6, 0]
        except np.linalg.LinAlgError:
            return np.full(6, np.inf)
        off -= off.mean(axis=0)
        views = (observations.views - 1) / observations.views * (off * off).sum(axis=0)
        # An error of the lens calibration is the same in all views.
        by_lens = np.linalg.inv(whole)[:6, 12:] / observations.lens_error
        found: Floats = np.sqrt(views + (by_lens * by_lens).sum(axis=1))
        return found


def first_estimate(observations: Observations, camera: Pose, board: Pose) -> Estimate:
    """Return an estimate with the calibrated lens and the measured joint angles."""
    return Estimate(camera, board, np.zeros(3), np.zeros((observations.views, 3)))


def refine(observations: Observations, estimate: Estimate) -> Fit:
    """Move camera and board until the corners fit best."""
    from scipy.optimize import least_squares  # takes a moment to load

    cost = float("inf")
    for _ in range(_ROUNDS):
        errors = observations.errors(estimate)
        if not np.isfinite(errors).all():
            break
        first, huber = estimate, _huber(_bound(errors) / _CORNER_PX, len(errors))
        found = least_squares(
            lambda step, first=first: observations.residuals(first.displace(step)),
            np.zeros(_SHARED + 3 * observations.views),
            lambda step, first=first: observations.jacobian(first.displace(step)),
            x_scale="jac",
            loss=huber,
            max_nfev=_MOST_STEPS,
        )
        estimate, cost = estimate.displace(found.x), float(found.cost)
        if float(np.abs(found.x[:12]).max()) < _SETTLED:
            break
    errors = observations.errors(estimate)
    plain = observations.errors(estimate._replace(turns_rad=np.zeros_like(estimate.turns_rad)))
    squares = (plain * plain).reshape(-1, 2).sum(axis=1)
    by_view = [np.sqrt(squares[observations.view == k].mean()) for k in range(observations.views)]
    return Fit(
        observations,
        estimate,
        cost,
        float(np.sqrt(squares.mean())),
        np.array(by_view),
        float(np.sqrt((errors * errors).reshape(-1, 2).sum(axis=1).mean())),
        float(np.degrees(np.sqrt((estimate.turns_rad**2).mean()))),
    )


def _huber(bound: float, corners: int) -> Callable[[Floats], Floats]:
    """Return Huber's loss of the corners' squares and two derivatives, in SciPy's format."""

    def loss(squares: Floats) -> Floats:
        rho = np.stack((squares, np.ones_like(squares), np.zeros_like(squares)))
        far = np.flatnonzero(squares[:corners] > bound * bound)
        size = np.sqrt(squares[far])
        rho[:, far] = 2.0 * bound * size - bound**2, bound / size, -0.5 * bound / size**3
        return rho

    return loss


def _bound(errors: Floats) -> float:
    """Return the size above which errors have less weight, in pixels."""
    return max(_HUBER * 1.4826 * float(np.median(np.abs(errors))), 1e-3)


_METHODS = (
    cv2.CALIB_HAND_EYE_PARK,
    cv2.CALIB_HAND_EYE_DANIILIDIS,
    cv2.CALIB_HAND_EYE_TSAI,
    cv2.CALIB_HAND_EYE_HORAUD,
)
_MOST_DROPPED = 0.2
# Limits in pixels are for images of this width and scale with it.
_WIDTH_PX = 640
# A search that ends with a larger error is repeated from the other starts.
_DOUBTFUL_PX = 1.0
# A view with an error up to this is never an outlier.
_GOOD_PX = 0.5
# Smallest assumed joint error: a quarter of a servo step.
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
    """View of the board: the head's pose at the time of a frame, and the board in the frame."""

    R_world_head: Mat3
    p_world_head_m: Vec3
    seen: DetectedBoard


@dataclass(frozen=True, slots=True)
class HandEye:
    """Result of the hand-eye calibration.

    R_head_camera, p_head_camera_m: pose of the camera in the head
    R_world_board, p_world_board_m: pose of the board, from the same fit
    lens: the input lens, with focal length and centre corrected by the same fit; it belongs to
        this pose of the camera
    rms_px: root mean square reprojection error with the measured joint angles; view_rms_px: of
        each kept view
    corner_px: remaining error if every neck joint may have a small error
    joint_error_deg: root mean square of those joint errors
    kept, dropped: numbers of the input views, from 0
    position_std_mm: standard deviation of each coordinate, from the influence of views and lens
    angle_std_deg: standard deviation about the camera's x, y and z axis, computed likewise;
        neither includes errors of the rig's geometry
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
        """Return the camera at the calibrated pose, rounded to 0.1 mm and 0.01 deg."""
        found = camera_at_pose(params, self.R_head_camera, self.p_head_camera_m)
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
    views: Sequence[NeckView], lens: Intrinsics, width_px: int, params: HandEyeParams | None = None
) -> HandEye:
    """Find the pose of the camera on the head.

    width_px: width of the frames; limits in pixels scale with it

    Raises:
        CameraCalibrationRefused: too few views, rotations about one axis only, or the result is
            not good or not certain enough.
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
    """Return the root mean square rotations between poses about the main axis and the second.

    If the second is 0, the head turned about one axis only, and the position of the camera along
    that axis is unknown.
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
    starts: list[tuple[float, Estimate]] = []
    for camera, board in _starts(views, lens):
        start = first_estimate(observations, camera, board)
        errors = np.abs(observations.errors(start))
        usual_px = float(np.median(np.where(np.isfinite(errors), errors, inf)))
        starts.append((usual_px, start))
    starts.sort(key=lambda one: one[0])
    if not starts:
        raise CameraCalibrationRefused(
            "the images of the board do not agree with any place of the camera: see that "
            "board, lens and joints are the ones calibrated"
        )
    best = refine(observations, starts[0][1])
    if not best.corner_px < _DOUBTFUL_PX:
        others = [refine(observations, other) for _, other in starts[1:]]
        best = min((best, *others), key=lambda fit: fit.cost)
    # Joints that are more accurate than usual get more weight.
    proven = min(max(best.joint_error_deg, _BEST_JOINT_DEG), params.joint_error_deg)
    return refine(observations._replace(joint_error_rad=radians(proven)), best.estimate)


def _starts(views: Sequence[NeckView], lens: Intrinsics) -> list[tuple[Pose, Pose]]:
    """Return the valid poses of camera and board from OpenCV's closed forms."""
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
            # Average of the board's poses: median position, mean rotation.
            u, _, vt = np.linalg.svd(np.sum([pose.R for pose in hung], axis=0))
            mean = u @ np.diag((1.0, 1.0, np.linalg.det(u @ vt))) @ vt
            found.append((camera, Pose(mean, np.median([pose.p for pose in hung], axis=0))))
    return found


def _vec3(row: Floats) -> Vec3:
    x, y, z = row.tolist()
    return x, y, z


def _mat3(R: Floats) -> Mat3:
    return _vec3(R[0]), _vec3(R[1]), _vec3(R[2])

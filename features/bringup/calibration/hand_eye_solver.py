"""Least squares of hand-eye calibration: camera on the head and board in the world. Pure.

Two rotations and two places are moved until the corners are reprojected best. Corners far off
count less (Huber). Joint sensors are not exact (steps of 0.088 deg, play of the gears),
and a head that is 0.1 deg off shifts a board 0.7 m away by more than all errors of its corners; so
each view has a small turn of the head as well, held near zero by how far joints are usually off.
Nor is the lens known exactly: 1 % of its focal length is 7 mm of the camera's place, but a head
that turns by known angles measures the lens too, so focal length and centre may move as far as a
calibration is usually off. The standard deviations come from leaving out one view at a time
(jackknife), and from how the place follows the lens.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.charuco_board import SeenBoard
from gazerig.robot.model.intrinsics import project

Floats = NDArray[np.float64]

# Steps for slopes by differences: radians, metres.
_SMALL = 1e-6
_MOST_STEPS = 60
# The bound of Huber follows the errors of the round before.
_ROUNDS = 4
# A last step of 1 um, or 0.00006 deg.
_SETTLED = 1e-6
# Numbers that all views share: camera, board, and focal length and centre of the lens.
_SHARED = 15
# Usual error of a corner; only its ratio to the joints' error matters.
_CORNER_PX = 0.3
# Huber's bound over the spread of the errors: 95 % as good as plain squares on normal noise.
_HUBER = 1.345


class Pose(NamedTuple):
    """A frame in its parent: rotation (3, 3) and place (3,) in metres."""

    R: Floats
    p: Floats

    def then(self, child: "Pose") -> "Pose":
        """Return the child's frame in this one's parent."""
        return Pose(self.R @ child.R, self.R @ child.p + self.p)

    def displace(self, step: Floats) -> "Pose":
        """Turn it about its own axes and shift it along its parent's."""
        return Pose(self.R @ np.asarray(cv2.Rodrigues(step[:3])[0]), self.p + step[3:])


class Estimate(NamedTuple):
    """Unknowns of the fit.

    camera: in the head; board: in the world
    lens_off: (3,) share by which the focal length is longer, pixels by which the centre is
        farther right and lower, than calibrated
    turns_rad: (views, 3) turn of each head beyond the measured joint angles
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
    """All corners of all views: n corners.

    R_world_head: (n, 3, 3); p_world_head_m, corners_board_m: (n, 3); corners_px: (n, 2)
    view: (n,) number of the view each belongs to; views: how many
    lens_error: (3,) how far focal length (as a share) and centre (pixels) are usually off
    joint_error_rad: how far joints are usually off
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
        views: Sequence[tuple[Mat3, Vec3, SeenBoard]],
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
        """Return by how much each corner is seen off: (2 n,) pixels, nan behind the camera."""
        world = self.corners_board_m @ estimate.board.R.T + estimate.board.p
        head = np.einsum("nji,nj->ni", self.R_world_head, world - self.p_world_head_m)
        # The turns are so small that their squares do not count.
        head -= np.cross(estimate.turns_rad[self.view], head)
        shown = project((head - estimate.camera.p) @ estimate.camera.R, estimate.lens(self.lens))
        return np.asarray((shown - self.corners_px).ravel(), dtype=np.float64)

    def slopes(self, estimate: Estimate) -> tuple[Floats, Floats]:
        """Return the slopes of errors by shared numbers (2 n, 15) and head turns (2 n, 3)."""
        columns = []
        for k in range(_SHARED + 3):
            step = np.zeros(_SHARED + 3 * self.views)
            step[[k] if k < _SHARED else slice(k, None, 3)] = _SMALL
            more, less = (self.errors(estimate.displace(sign * step)) for sign in (1.0, -1.0))
            columns.append((more - less) / (2.0 * _SMALL))
        return np.stack(columns[:_SHARED], axis=1), np.stack(columns[_SHARED:], axis=1)

    def residuals(self, estimate: Estimate) -> Floats:
        """Return the errors over a corner's usual one, then lens and turns over theirs."""
        usual = np.concatenate(
            (self.lens_error, np.full(estimate.turns_rad.size, self.joint_error_rad))
        )
        off = np.concatenate((estimate.lens_off, estimate.turns_rad.ravel())) / usual
        return np.concatenate((self.errors(estimate) / _CORNER_PX, off))

    def jacobian(self, estimate: Estimate) -> Floats:
        """Return the slopes of ``residuals``: (2 n + 3 + 3 views, 15 + 3 views)."""
        shared, own = self.slopes(estimate)
        rows, columns = len(shared), _SHARED + 3 * self.views
        slopes = np.zeros((rows + columns - 12, columns))
        slopes[:rows, :_SHARED] = shared / _CORNER_PX
        at = _SHARED + 3 * np.repeat(self.view, 2)
        for k in range(3):
            slopes[np.arange(rows), at + k] = own[:, k] / _CORNER_PX
        usual = np.concatenate((self.lens_error, np.full(columns - _SHARED, self.joint_error_rad)))
        slopes[rows:, 12:] = np.diag(1.0 / usual)
        return slopes


@dataclass(frozen=True)
class Fit:
    """Result of the fit.

    cost: what it made small
    rms_px, view_rms_px: reprojection errors with the measured joint angles
    corner_px: what is left of them when each head may be turned a little
    joint_error_deg: root mean square of those turns, a joint
    """

    observations: Observations
    estimate: Estimate
    cost: float
    rms_px: float
    view_rms_px: Floats
    corner_px: float
    joint_error_deg: float

    def spread(self) -> Floats:
        """Return standard deviations (6,) of the camera's turn (rad) and place (m)."""
        observations, errors = self.observations, self.observations.errors(self.estimate)
        shared, own = observations.slopes(self.estimate)
        weight, of_row = _weights(errors), np.repeat(observations.view, 2)
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
            # Without view k the best place is this far from the best with all of them.
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
    """Return an estimate with the lens as calibrated and the measured joint angles."""
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
    """Return Huber's loss of the first residuals, those of corners, and squares of the others.

    It has the form that scipy.optimize.least_squares takes: of squares, with two derivatives.
    """

    def loss(squares: Floats) -> Floats:
        rho = np.stack((squares, np.ones_like(squares), np.zeros_like(squares)))
        far = np.flatnonzero(squares[:corners] > bound * bound)
        size = np.sqrt(squares[far])
        rho[:, far] = 2.0 * bound * size - bound**2, bound / size, -0.5 * bound / size**3
        return rho

    return loss


def _bound(errors: Floats) -> float:
    """Return the size beyond which errors count less, in pixels."""
    return max(_HUBER * 1.4826 * float(np.median(np.abs(errors))), 1e-3)


def _weights(errors: Floats) -> Floats:
    """Return the weight of each error, 1/px^2."""
    weight = np.minimum(1.0, _bound(errors) / np.maximum(np.abs(errors), 1e-12))
    return np.asarray(weight / _CORNER_PX**2, dtype=np.float64)

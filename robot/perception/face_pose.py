"""Pose of a face from five landmarks in an image.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up.
Camera frame: optical, x right, y down, z forward. Metres; pixels have their centres at
whole numbers.

Five points nearly in one plane determine position and roll well, and yaw and pitch poorly. Faces
also differ, in length and most of all at the mouth: a smile widens it, raises its corners and
draws them back. A rigid face model (``cv2.solvePnP``) could explain this only by a nod of ten
degrees or more. The pose is therefore the most probable one. It combines reprojection errors
weighted by usual landmark errors, a mouth of the observed width with corners at the positions of
such a smile, priors on their height and on the face's length, and a weak prior that a detected face
is turned towards the camera. The search starts from a face that looks into the camera, so it ends
at the nearer of the two mirror poses of a flat set of points.
"""

from collections.abc import Sequence
from functools import reduce
from math import cos, dist, hypot, isfinite, radians, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import FaceSigns
from gazerig.gaze.angles import (
    add,
    compose,
    cross,
    dot,
    norm,
    perpendicular,
    rotate,
    rotate_back,
    scale,
    sub,
    transpose,
    turn_about,
    unit,
)
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.face_geometry import EYES_TO_MOUTH_M, LANDMARKS_FACE_M, PUPIL_DISTANCE_M
from gazerig.robot.model.intrinsics import rays

# Usual landmark error: in pixels, and as a fraction of the distance between the eyes.
_NOISE_PX, _NOISE_OF_EYES = 1.0, 0.04
# Twice the area of the triangle of eyes and mouth, below which the points have merged.
_LEAST_AREA_PX2 = 1.0
# A face turned farther than this from the line of sight is not accepted.
_MOST_TURNED_RAD = radians(75.0)
# Prior: spread of pitch and yaw of a detected face about the direction to the camera, and spread of
# face lengths at a given distance between the eyes; as information, 1 / spread^2.
_PITCH_INFO, _YAW_INFO = radians(22.0) ** -2, radians(30.0) ** -2
_LENGTH_INFO = 0.1**-2
# A smile: spread of mouth widths over the usual one; and the motion of a corner up and back per
# motion outward, from the dense mesh of a laughing and a calm face (7.6 mm out, 7.6 up, 6.6 back).
# Limits of accepted mouth widths, as fractions of the usual width below and above it.
_WIDTH_SPREAD, _UP_OF_OUT, _BACK_OF_OUT = 0.18, 1.0, 0.87
_NARROWEST, _WIDEST = -0.3, 0.5
# Spread of the remaining height of the mouth's corners, as a fraction of the eye distance.
_MOUTH_HEIGHT_OF_EYES = 0.2
# Each step is a fraction of the previous one, so the remainder after the last is known; a
# thousandth is accepted (0.06 deg, 1 mm at 1 m). 2 steps are usual. With noise of a tenth of the
# face, one fit in a hundred has not converged after 20.
_REMAINS, _MOST_STEPS = 1e-3, 20
# Variance of the nose's distance from the middle of the four others, over that of one point.
_OF_FIVE = 1.25
# A face that looks straight into the camera: its left is the image's right, its up the image's
# up. The tip of its nose is the origin.
_FRONTAL_M: tuple[Vec3, ...] = tuple((y, -z, -x) for x, y, z in LANDMARKS_FACE_M.tolist())
_NOSE_OUT_M = sum(z for _, _, z in _FRONTAL_M) / 4.0
_HALF_MOUTH_M = _FRONTAL_M[4][0]
_USUAL_WIDTH = 2.0 * _HALF_MOUTH_M / PUPIL_DISTANCE_M

Points = Sequence[tuple[float, float]]


class FacePose(NamedTuple):
    """Position and turn of a face; of a mesh also the state of eyes and lips.

    p_camera_m:    tip of the nose
    R_camera_face: face axes in the camera frame
    length:        length of the face relative to the canonical face
    turn_sd_rad:   standard deviation of its turn, the larger of yaw and pitch
    gaze_camera:   unit vector of the eyes' gaze; None if the irises are not visible or the eyes are
        shut
    signs:         eyes and lips, None if unknown
    """

    p_camera_m: Vec3
    R_camera_face: Mat3
    length: float
    turn_sd_rad: float = 0.0
    gaze_camera: Vec3 | None = None
    signs: FaceSigns | None = None


def face_pose(landmarks_px: ArrayLike, intrinsics: Intrinsics) -> FacePose | None:
    """Return the pose of an adult face, None if the points are not those of a face from its front.

    Args:
        landmarks_px: (5, 2) in the order of DetectedFace.
        intrinsics: intrinsics of the image.
    """
    points = np.asarray(landmarks_px, dtype=np.float64)
    if points.shape != (5, 2) or not _shows_front(points.tolist()):
        return None
    seen: list[Vec3] = rays(points, intrinsics).tolist()
    noise = _NOISE_PX / sqrt(intrinsics.fx_px * intrinsics.fy_px)
    # Axes of a camera turned to the face and rolled until the eyes are level: poses near "looks at
    # the camera" are small rotations wherever the face appears.
    z = unit(reduce(add, seen))
    x = unit(perpendicular(sub(seen[1], seen[0]), z))
    towards = x, cross(z, x), z
    try:
        turned = [rotate(towards, ray) for ray in seen]
        found = _fit_face([(x / z, y / z) for x, y, z in turned], noise)
    except (ArithmeticError, ValueError):  # points that determine no pose
        return None
    if found is None:
        return None
    ((r00, r01, r02), (r10, r11, r12), (r20, r21, r22)), p, length = found
    p = rotate_back(towards, p)
    axes = (-r02, r00, -r01), (-r12, r10, -r11), (-r22, r20, -r21)
    R = compose(transpose(towards), axes)
    nearest_m = p[2] + min(dot(R[2], (-z, x, -y * length)) for x, y, z in _FRONTAL_M)
    turned_away = dot((R[0][0], R[1][0], R[2][0]), p) > -cos(_MOST_TURNED_RAD) * norm(p)
    if turned_away or not nearest_m > 0.0:
        return None
    # The yaw is less certain than the pitch. The nose projects from the plane of eyes and mouth,
    # and its image position shows the turn.
    per_rad = _NOSE_OUT_M / norm(p)
    variance = noise * noise + (_NOISE_OF_EYES * PUPIL_DISTANCE_M / norm(p)) ** 2
    turn_sd_rad = 1.0 / sqrt(per_rad * per_rad / (_OF_FIVE * variance) + _YAW_INFO)
    return FacePose(p, R, length, turn_sd_rad)


def _shows_front(points: Points) -> bool:
    """Return whether eyes and mouth have the orientation of a face seen from its front.

    The sign of the area of a projected triangle shows which side of its plane is visible; a
    degenerate triangle shows neither side.
    """
    (ax, ay), (bx, by), (nx, ny), (cx, cy), (dx, dy) = points
    if not isfinite(nx + ny):
        return False
    down_x, down_y = 0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by)
    return (bx - ax) * down_y - (by - ay) * down_x > _LEAST_AREA_PX2


def _fit_face(seen: Points, noise: float) -> tuple[Mat3, Vec3, float] | None:
    """Return the most probable face by Gauss-Newton steps, None if the points determine none.

    The result is its rotation from a face that looks straight into the camera, the position of its
    nose, and its length. The width of the mouth over the
    distance of the eyes hardly depends on the turn of the face. It gives the strength of a smile,
    and so the positions of the mouth's corners; their height is free within wide bounds.

    Args:
        seen: the points on the plane z = 1 of a camera turned to the face.
        noise: usual error of a point on that plane, without the part that grows with the face.
    """
    (ax, ay), (bx, by), nose, (cx, cy), (ex, ey) = seen
    eyes, width = dist(seen[0], seen[1]), _mouth_width(seen)
    height = hypot(0.5 * (cx + ex - ax - bx), 0.5 * (cy + ey - ay - by))
    variance = noise * noise + (_NOISE_OF_EYES * eyes) ** 2
    # A turn shortens one of the face's two lengths, so the longer one is more reliable.
    away_m = 1.0 / max(eyes / PUPIL_DISTANCE_M, height / EYES_TO_MOUTH_M)
    # Weights of the points' heights, as a root: that of the mouth's corners is hardly known.
    mouth = sqrt(variance / (variance + (_MOUTH_HEIGHT_OF_EYES * eyes) ** 2))
    weights = 1.0, 1.0, 1.0, mouth, mouth
    pitch, yaw, long = variance * _PITCH_INFO, variance * _YAW_INFO, variance * _LENGTH_INFO
    # The nose projects from the plane of eyes and mouth: its image position shows the turn.
    aside, below = nose[0] - 0.25 * (ax + bx + cx + ex), nose[1] - 0.25 * (ay + by + cy + ey)
    per_rad = _NOSE_OUT_M / away_m
    turn: Vec3 = (
        below * per_rad / (per_rad * per_rad + _OF_FIVE * pitch),
        -aside * per_rad / (per_rad * per_rad + _OF_FIVE * yaw),
        0.0,
    )
    # Accepted part of the excess over the usual width of the mouth.
    ratio = width / _USUAL_WIDTH
    unsure = 2.0 * (variance / (eyes * eyes)) * (1.0 / _USUAL_WIDTH**2 + ratio * ratio)
    believed = _WIDTH_SPREAD**2 / (_WIDTH_SPREAD**2 + unsure)
    z = away_m - _NOSE_OUT_M
    p, length, wider, before = (nose[0] * z, nose[1] * z, z), 1.0, 0.0, 0.1
    R, frontal = turn_about(unit(turn), norm(turn)), _FRONTAL_M
    for _ in range(_MOST_STEPS):
        rows = np.array(_rows(seen, weights, frontal, R, p, length)).reshape(-1, 8)
        normal = rows.T @ rows
        # A rotation vector moves with a small turn by that turn and half its product with the
        # vector.
        held = pitch * turn[0], yaw * turn[1], 0.0
        pull = add(held, scale(cross(turn, held), 0.5))
        normal[0, 0] += pitch
        normal[1, 1] += yaw
        normal[6, 6] += long
        normal[:3, 7] -= pull
        normal[6, 7] -= long * (length - 1.0)
        step = np.linalg.solve(normal[:7, :7], normal[:7, 7]).tolist()
        w = step[:3]
        turn = add(turn, sub(w, scale(cross(turn, w), 0.5)))
        R, p, length = turn_about(unit(turn), norm(turn)), add(p, step[3:6]), length + step[6]
        if not p[2] > 0.0:  # behind the camera, or not finite
            return None
        last = wider
        # The observed width of the mouth at this pose.
        placed = [add(p, rotate(R, (x, length * y, z))) for x, y, z in frontal]
        at_pose = _mouth_width([(x / z, y / z) for x, y, z in placed])
        wider = (1.0 + wider) * width / at_pose - 1.0
        wider = believed * min(max(wider, _NARROWEST), _WIDEST)
        frontal = _smile(wider)
        shift = max(map(abs, step[3:6])) / away_m
        moved = max(*map(abs, w), shift, abs(step[6]), abs(wider - last))
        if moved * moved < _REMAINS * before:
            return R, p, length
        before = moved
    return None


def _rows(
    seen: Points,
    weights: Sequence[float],
    frontal: Sequence[Vec3],
    R: Mat3,
    p_m: Vec3,
    length: float,
) -> list[float]:
    """Return the motion of each image coordinate per step, and its error: ten rows of 7 + 1.

    A step is a small turn w, which moves a point P by w x P, a shift, and a growth of the length.
    The rows of the heights are multiplied by their weights.
    """
    rows: list[float] = []
    (_, r01, _), (_, r11, _), (_, r21, _) = R
    for (x, y, z), (x_seen, y_seen), weight in zip(frontal, seen, weights, strict=True):
        X, Y, Z = rotate(R, (x, length * y, z))
        q = 1.0 / (Z + p_m[2])
        u, v = (X + p_m[0]) * q, (Y + p_m[1]) * q
        rows += (
            -u * Y * q,
            (Z + u * X) * q,
            -Y * q,
            q,
            0.0,
            -u * q,
            y * (r01 - u * r21) * q,
            x_seen - u,
        )
        off, q = weight * (y_seen - v), weight * q
        rows += ((-Z - v * Y) * q, v * X * q, X * q, 0.0, q, -v * q, y * (r11 - v * r21) * q, off)
    return rows


def _smile(wider: float) -> tuple[Vec3, ...]:
    """Return the points of a frontal face whose mouth is wider by a fraction."""
    out = wider * _HALF_MOUTH_M
    x, y, z = _FRONTAL_M[4]
    x, y, z = x + out, y - _UP_OF_OUT * out, z + _BACK_OF_OUT * out
    return (*_FRONTAL_M[:3], (-x, y, z), (x, y, z))


def _mouth_width(seen: Points) -> float:
    return dist(seen[3], seen[4]) / dist(seen[0], seen[1])

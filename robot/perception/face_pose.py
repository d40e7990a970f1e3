"""Five landmarks in an image -> where a face is, how it is turned, and its eight parts.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up.
Camera frame: optical, x right, y down, z forward. Metres; pixels have their centres at
whole numbers.

Five points that lie nearly in one plane say much about place and roll, and little about
yaw and pitch; and faces differ, in length most of all (a smile alone takes a tenth off
it), which a fixed face would have to explain by a nod. The pose is therefore the most
probable one: reprojection errors weighted by what landmarks are usually off by, a face
length that is free within what is usual, and a weak belief that a face which a camera
finds is turned towards it. The search starts from a face that looks into the camera, so
it ends at the nearer of the two mirror poses of a flat set of points.
"""

from dataclasses import dataclass
from math import cos, hypot, isfinite, radians, sqrt

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.gaze.types import PARTS, Mat3, Vec3
from gazerig.robot.model.face_geometry import (
    EYES_TO_MOUTH_M,
    LANDMARKS_FACE_M,
    PARTS_FACE_M,
    PUPIL_DISTANCE_M,
)
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.intrinsics import rays as rays_through

Floats = NDArray[np.float64]


_PARTS_FACE_M: Floats = np.array([PARTS_FACE_M[part] for part in PARTS])

# A face that looks straight into a camera: its left is the image's right, its up the
# image's up, and what comes out of it comes towards the camera.
_R_FRONTAL = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)])
_LANDMARKS_FRONTAL_M = LANDMARKS_FACE_M @ _R_FRONTAL.T
_PLAIN_CAMERA = np.eye(3)

# Usual landmark error: a pixel, and a part of the distance between the eyes.
_NOISE_PX, _NOISE_OF_EYES = 1.0, 0.04
# Spread of face lengths at a given distance between the eyes.
_LENGTH_SPREAD = 0.1
# Spread of the belief that a face found is turned to the camera, pitch and yaw.
_PITCH_SPREAD_RAD, _YAW_SPREAD_RAD = radians(20.0), radians(30.0)
# Rows of the fit that hold beliefs, the numbers they are about, and their spreads.
_BELIEFS, _BELIEVED = [10, 11, 12], [0, 1, 6]
_SPREADS = np.array([_PITCH_SPREAD_RAD, _YAW_SPREAD_RAD, _LENGTH_SPREAD])
# Twice the triangle of eyes and mouth, below which points have run into one.
_LEAST_AREA_PX2 = 1.0
# Nothing beyond this angle from the line of sight is taken for a face that is seen.
_MOST_TURNED_RAD = radians(75.0)
# A step below a thousandth (0.06 deg, 1 mm at 1 m) is the last; 4 are usual. Where the
# noise is a tenth of the face, one try in a hundred is not done after 20.
_SMALL_STEP, _MOST_STEPS = 1e-3, 20


@dataclass(frozen=True, slots=True)
class FacePose:
    """Where a face is and how it is turned.

    p_camera_m:    tip of the nose
    R_camera_face: face axes in the camera frame
    length:        length of the face over the canonical one's
    reprojection_px: root mean square distance of the landmarks from those of that face
    """

    p_camera_m: Vec3
    R_camera_face: Mat3
    length: float
    reprojection_px: float


def face_pose(landmarks_px: ArrayLike, intrinsics: Intrinsics) -> FacePose | None:
    """Find the pose of an adult face, or None where the points show none from its front.

    landmarks_px: (5, 2) in the order of DetectedFace
    """
    points = np.asarray(landmarks_px, dtype=np.float64)
    if points.shape != (5, 2) or not np.isfinite(points).all() or not _front_seen(points):
        return None
    rays = rays_through(points, intrinsics)
    R_face_camera = _facing_camera(rays)
    turned = rays @ R_face_camera.T
    seen = turned[:, :2] / turned[:, 2:]
    found = _most_probable(seen, _NOISE_PX / sqrt(intrinsics.fx_px * intrinsics.fy_px))
    if found is None:
        return None
    R = R_face_camera.T @ cv2.Rodrigues(found[:3])[0] @ _R_FRONTAL
    p = R_face_camera.T @ found[3:6]
    length = 1.0 + float(found[6])
    if R[:, 0] @ p > -cos(_MOST_TURNED_RAD) * sqrt(p @ p):
        return None
    off = project(_lengthened(LANDMARKS_FACE_M, length) @ R.T + p, intrinsics) - points
    rms_px = sqrt(float(np.vdot(off, off)) / len(points))
    if not isfinite(rms_px):  # part of such a face would be behind the camera
        return None
    return FacePose(_vec3(p), (_vec3(R[0]), _vec3(R[1]), _vec3(R[2])), length, rms_px)


def face_parts(pose: FacePose) -> Floats:
    """Return the eight parts in the order of gaze.types.PARTS: (8, 3), camera frame."""
    parts_face_m = _lengthened(_PARTS_FACE_M, pose.length)
    parts: Floats = parts_face_m @ np.array(pose.R_camera_face).T + pose.p_camera_m
    return parts


def _front_seen(points: Floats) -> bool:
    """Return whether eyes and mouth run round the way they do on a face seen from its front.

    The sign of a projected triangle tells exactly which side of its plane is seen; one
    without any size tells nothing.
    """
    (eyes_x, eyes_y), (down_x, down_y) = _spans(points)
    return eyes_x * down_y - eyes_y * down_x > _LEAST_AREA_PX2


def _spans(points: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ways from right to left eye and from the eyes' middle to the mouth's."""
    (ax, ay), (bx, by), _, (cx, cy), (dx, dy) = points.tolist()
    return (bx - ax, by - ay), (0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by))


def _facing_camera(rays: Floats) -> Floats:
    """Turn the camera towards the face and roll it so that the eyes lie level: a rotation.

    Seen so, poses near "looks at me" are small rotations wherever the face appears.
    """
    z = rays.sum(axis=0)
    z /= sqrt(z @ z)
    eyes = rays[1] - rays[0]
    x = eyes - z * (eyes @ z)
    x /= sqrt(x @ x)
    # y = z x x, written out: numpy's cross product takes longer than all the rest here.
    y = (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0])
    return np.array([x, y, z])


def _most_probable(seen: Floats, noise: float) -> Floats | None:
    """Fit a face to points on the plane z = 1 by Gauss-Newton steps.

    noise: usual error of a point on that plane, beside the part that grows with the face

    Returns (7,): rotation vector from the frontal face, place, and length less 1.
    """
    eyes, height = (hypot(*span) for span in _spans(seen))
    weight = 1.0 / hypot(noise, _NOISE_OF_EYES * eyes)
    # A turned face shows one of its two lengths shortened, so the longer one tells more.
    away_m = 1.0 / max(eyes / PUPIL_DISTANCE_M, height / EYES_TO_MOUTH_M)
    size = np.array([1.0, 1.0, 1.0, away_m, away_m, away_m, 1.0])
    face = np.array([0.0, 0.0, 0.0, 0.0, 0.0, away_m, 0.0])
    slopes, errors = np.zeros((13, 7)), np.zeros(13)
    slopes[_BELIEFS, _BELIEVED] = 1.0 / _SPREADS
    for _ in range(_MOST_STEPS):
        stretched = _LANDMARKS_FRONTAL_M * (1.0, 1.0 + face[6], 1.0)
        points, jacobian = cv2.projectPoints(stretched, face[:3], face[3:6], _PLAIN_CAMERA, None)
        slopes[:10, :6] = jacobian[:, :6]
        slopes[:10, 6] = _length_slopes(slopes[:10, 3:6], face[:3])
        slopes[:10] *= weight
        errors[:10] = (seen - points[:, 0]).ravel() * weight
        errors[_BELIEFS] = -face[_BELIEVED] / _SPREADS
        try:
            step = np.linalg.solve(slopes.T @ slopes, slopes.T @ errors)
        except np.linalg.LinAlgError:  # points so far from a face that they settle nothing
            return None
        face += step
        if not face[5] > 0.0:  # behind the camera, or no number
            return None
        if max(map(abs, (step / size).tolist())) < _SMALL_STEP:
            return face
    return None


def _length_slopes(place_slopes: Floats, turn: Floats) -> Floats:
    """Return how the ten coordinates move with the length, from how they move with the place."""
    upright = cv2.Rodrigues(turn)[0][:, 1]
    per_metre = (place_slopes @ upright).reshape(5, 2)
    slopes: Floats = (per_metre * _LANDMARKS_FRONTAL_M[:, 1:2]).ravel()
    return slopes


def _lengthened(points_face_m: Floats, length: float) -> Floats:
    """Stretch points of the canonical face along its upright axis."""
    return points_face_m * (1.0, 1.0, length)


def _vec3(row: Floats) -> Vec3:
    """Turn three numbers of an array into plain floats."""
    x, y, z = row.tolist()
    return x, y, z

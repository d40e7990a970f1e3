"""Pose of a face from five landmarks in an image, or from a dense mesh with eyes and lips.

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

The pose of a mesh is the similarity that maps a rigid part of an average face (nose, forehead,
temples, cheekbones; not mouth, jaw or brows) onto it. The network estimates the mesh's third
coordinate in the scale of the other two, along the line of sight. The position follows from the
points in the image. An eye's line of sight runs from the centre of the eyeball, which is behind the
midpoint between the corners of the lids, through the centre of the iris.
"""

from collections.abc import Sequence
from functools import reduce
from math import cos, dist, hypot, isfinite, radians, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import FaceMesh, FaceSigns
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
from gazerig.gaze.types import Floats, Mat3, Vec3, vec
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


EYES_SHUT = 0.35
"""Eye opening below which eyes count as shut."""

# Points of the mesh on an average face, mm: out of the face and up for points on the midline; out,
# sideways and up for pairs (right, left). Mean of the network's meshes of two people.
_MIDDLE_MM = {
    168: (-20.9, 37.6), 6: (-16.7, 30.5), 197: (-11.9, 23.9), 195: (-6.6, 17.8), 5: (-1.1, 11.3),
    4: (1.1, 3.1), 1: (-1.1, -3.1), 2: (-16.8, -8.9), 10: (-24.1, 81.9), 151: (-21.1, 67.5),
    9: (-19.0, 52.5), 8: (-20.5, 44.5),
}  # fmt: skip
_PAIRS_MM = {
    (33, 263): (-42.9, 44.6, 32.5), (133, 362): (-37.6, 17.3, 31.4), (98, 327): (-24.7, 18.6, -6.0),
    (67, 297): (-32.0, 34.5, 78.4), (109, 338): (-25.7, 18.8, 81.3), (103, 332): (-43.0, 48.9, 72.4),
    (54, 284): (-55.6, 57.9, 63.6), (127, 356): (-91.4, 67.0, 27.3), (234, 454): (-96.4, 66.2, 14.2),
    (93, 323): (-97.5, 65.4, 1.1), (116, 345): (-55.6, 61.5, 17.5), (117, 346): (-43.5, 51.5, 18.2),
    (50, 280): (-37.9, 48.7, 4.6), (101, 330): (-32.7, 34.4, 10.9), (193, 417): (-25.2, 7.7, 36.4),
    (122, 351): (-19.2, 5.7, 28.9), (188, 412): (-23.1, 9.6, 25.3),
}  # fmt: skip
_RIGID = [*_MIDDLE_MM, *(index for pair in _PAIRS_MM for index in pair)]
_RIGID_M: Floats = 1e-3 * np.array(
    [(x, 0.0, z) for x, z in _MIDDLE_MM.values()]
    + [(x, side * y, z) for x, y, z in _PAIRS_MM.values() for side in (-1.0, 1.0)]
)
_EYES = (33, 133), (362, 263)
_EYES_M = np.array([_RIGID_M[[_RIGID.index(i) for i in pair]].mean(axis=0) for pair in _EYES])
_LIPS, _FOREHEAD, _CHIN, _HEIGHT_M = (13, 14), 10, 152, 0.152
# Lids along the contour of an eye: middle of the upper and of the lower one.
_UPPER_LID, _LOWER_LID, _CORNERS = 12, 4, (0, 8)

# Distance of the eyeball's centre behind the midpoint between the corners; distance from it to the
# iris; and weight of the corners' positions in the image; the remaining weight is the pose's.
_BALL_BEHIND_M, _IRIS_FROM_BALL_M, _SEEN_SHARE = 0.007, 0.0105, 0.75
# Gap between the lids in the network's mesh, for shut eyes and for normally open ones.
_LIDS_SHUT_M, _LIDS_OPEN_M = 0.0043, 0.0088
# Usual error of a turn, and of a point in pixels, which grows with the turn's fraction of the face.
_TURN_SD_RAD, _POINT_PX, _DEEP_M = radians(3.0), 0.7, 0.03
_MOST_TURNED = 0.25
_LONGEST = 1.35


def read_mesh(mesh: FaceMesh, intrinsics: Intrinsics) -> FacePose | None:
    """Return the contents of a mesh, None if its points are not those of a face from its front."""
    points = mesh.points.astype(np.float64)
    if points.shape != (468, 3) or not np.isfinite(points).all():
        return None
    rigid = points[_RIGID]
    seen = rays(rigid[:, :2], intrinsics)
    focal_px = sqrt(intrinsics.fx_px * intrinsics.fy_px)
    towards = _rotation_towards(seen.mean(axis=0))
    turn = _turn(seen @ towards, rigid[:, 2] - rigid[:, 2].mean(), focal_px)
    if turn is None:
        return None
    R = towards @ turn
    p = _position(R, seen)
    if p is None:
        return None
    facing = -float(R[:, 0] @ p) / float(np.linalg.norm(p))
    if not facing > _MOST_TURNED:
        return None
    px_m = float(p[2]) / focal_px  # size of a pixel at the face
    tall = float(np.linalg.norm(points[_FOREHEAD] - points[_CHIN]))
    apart = float(np.linalg.norm(points[list(_EYES[0])].mean(0) - points[list(_EYES[1])].mean(0)))
    if not apart > 0.0:
        return None
    length = min(max(tall / apart * PUPIL_DISTANCE_M / _HEIGHT_M, 1.0 / _LONGEST), _LONGEST)
    sd = hypot(_TURN_SD_RAD, _POINT_PX * px_m / _DEEP_M)
    opening = None if mesh.lids_px is None else _eye_opening(mesh.lids_px, apart)
    lips = float(np.linalg.norm(points[_LIPS[0]] - points[_LIPS[1]]))
    # The network guesses what it does not see of a mouth from its side.
    signs = FaceSigns(opening, lips / apart * PUPIL_DISTANCE_M, _POINT_PX * px_m / facing**4)
    shut = opening is None or opening < EYES_SHUT
    gaze = None if shut else _gaze(mesh, R, p, intrinsics)
    x, y, z = (vec(row) for row in R)
    return FacePose(vec(p), (x, y, z), length, sd, gaze, signs)


def _turn(rays: Floats, depth_px: Floats, focal_px: float) -> Floats | None:
    """Return the rotation of a face from the rays of its points, about the ray of its middle.

    Args:
        rays: rays (n, 3) through the points; z along the line of sight.
        depth_px: depths (n,) relative to the centre, in pixels at its distance.
        focal_px: focal length of the lens, which is also that distance in those pixels.
    """
    deep = 1.0 + depth_px / focal_px
    flat = rays[:, :2] / rays[:, 2:] * deep[:, np.newaxis]
    seen = np.column_stack([flat, deep])
    # The rotation of the similarity that maps the face onto the points (Kabsch).
    a, b = _RIGID_M - _RIGID_M.mean(axis=0), seen - seen.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = float(np.sign(np.linalg.det(vt.T @ u.T)))
    return None if flip == 0.0 else np.asarray(vt.T @ np.diag([1.0, 1.0, flip]) @ u.T)


def _rotation_towards(ray: Floats) -> Floats:
    x, y, z = ray / np.linalg.norm(ray)
    cross = np.array([(0.0, 0.0, x), (0.0, 0.0, y), (-x, -y, 0.0)])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + z))


def _position(R: Floats, seen: Floats) -> Floats | None:
    """Return the position of a face of known turn from the rays of its points, by least squares."""
    turned = _RIGID_M @ R.T
    rows: Floats = np.zeros((len(seen), 2, 3))
    rows[:, :, :2], rows[:, :, 2] = np.eye(2), -seen[:, :2]
    wanted: Floats = seen[:, :2] * turned[:, 2:] - turned[:, :2]
    found = np.asarray(np.linalg.lstsq(rows.reshape(-1, 3), wanted.ravel())[0], np.float64)
    return found if np.isfinite(found).all() and found[2] > 0.0 else None


def _eye_opening(lids_px: NDArray[np.float32], apart: float) -> float:
    """Return the opening of the eyes relative to the usual one, from the contours of the lids.

    The points of the mesh itself hardly follow the lids.
    """
    lids = lids_px.astype(np.float64)
    gap_px = float(np.linalg.norm(lids[:, _UPPER_LID] - lids[:, _LOWER_LID], axis=1).mean())
    gap_m = gap_px / apart * PUPIL_DISTANCE_M
    return max(0.0, (gap_m - _LIDS_SHUT_M) / (_LIDS_OPEN_M - _LIDS_SHUT_M))


def _gaze(mesh: FaceMesh, R: Floats, p: Floats, intrinsics: Intrinsics) -> Vec3 | None:
    """Return the gaze of both eyes; the eye that appears wider has more weight."""
    if mesh.irises_px is None or mesh.lids_px is None:
        return None
    corners = mesh.lids_px[:, list(_CORNERS)].astype(np.float64)
    sides = rays(corners.mean(axis=1), intrinsics)
    irises = rays(mesh.irises_px[:, 0].astype(np.float64), intrinsics)
    widths = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)
    if not (np.isfinite(sides).all() and np.isfinite(irises).all() and widths.min() > 0.0):
        return None
    ways = np.zeros(3)
    for at, side, iris, width in zip(_EYES_M @ R.T + p, sides, irises, widths, strict=True):
        middle = _SEEN_SHARE * side * at[2] + (1.0 - _SEEN_SHARE) * at
        centre = middle - _BALL_BEHIND_M * R[:, 0]
        way = iris / np.linalg.norm(iris)
        along = float(way @ centre)
        short = along * along - float(centre @ centre) + _IRIS_FROM_BALL_M**2
        look = way * (along - sqrt(max(short, 0.0))) - centre
        ways += width * width * look / np.linalg.norm(look)
    size = float(np.linalg.norm(ways))
    return vec(ways / size) if size > 0.0 and np.isfinite(size) else None

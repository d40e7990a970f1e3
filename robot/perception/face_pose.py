"""Five landmarks in an image -> where a face is and how it is turned.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up.
Camera frame: optical, x right, y down, z forward. Metres; pixels have their centres at
whole numbers.

Five points that lie nearly in one plane say much about place and roll, and little about
yaw and pitch; and faces differ, in length and about the mouth most of all: a smile widens it,
raises its corners and draws them back, which a fixed face would have to explain by a nod of ten
degrees and more. The pose is therefore the most probable one: reprojection errors weighted by
what landmarks are usually off by, a mouth as wide as it is seen with corners where a smile so
wide puts them, their height and the face's length free within what is usual, and a weak belief
that a face which a camera finds is turned towards it. The search starts from a face that looks
into the camera, so it ends at the nearer of the two mirror poses of a flat set of points.
"""

from math import cos, isfinite, radians, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.gaze.angles import compose, cross, dot, norm, rotate_back, scale, sub, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.intrinsics import rays as rays_through
from gazerig.robot.perception.face_fit import Points, fitted_face, nearest_m, turn_sd_rad

# Usual landmark error beside the part that grows with the face.
_NOISE_PX = 1.0
# Twice the triangle of eyes and mouth, below which points have run into one.
_LEAST_AREA_PX2 = 1.0
# Nothing beyond this angle from the line of sight is taken for a face that is seen.
_MOST_TURNED_RAD = radians(75.0)


class FacePose(NamedTuple):
    """Where a face is and how it is turned.

    p_camera_m:    tip of the nose
    R_camera_face: face axes in the camera frame
    length:        length of the face over the canonical one's
    turn_sd_rad:   standard deviation of its turn, the larger of yaw and pitch
    """

    p_camera_m: Vec3
    R_camera_face: Mat3
    length: float
    turn_sd_rad: float = 0.0


def face_pose(landmarks_px: ArrayLike, intrinsics: Intrinsics) -> FacePose | None:
    """Return the pose of an adult face, or None where the points show none from its front.

    Args:
        landmarks_px: (5, 2) in the order of DetectedFace.
        intrinsics: of the image.
    """
    array = np.asarray(landmarks_px, dtype=np.float64)
    points: list[list[float]] = array.tolist()
    if array.shape != (5, 2) or not _front_seen(points):
        return None
    rays = _rays(points, intrinsics)
    R_face_camera = _facing_camera(rays)
    try:
        found = fitted_face(
            _seen_from(R_face_camera, rays),
            _NOISE_PX / sqrt(intrinsics.fx_px * intrinsics.fy_px),
        )
    except (ArithmeticError, ValueError):  # points so far from a face that they settle nothing
        return None
    if found is None:
        return None
    p = rotate_back(R_face_camera, found.p_m)
    R = compose(_transposed(R_face_camera), _face_axes(found.R))
    outwards = (R[0][0], R[1][0], R[2][0])
    if dot(outwards, p) > -cos(_MOST_TURNED_RAD) * norm(p):
        return None
    if not nearest_m(R, p, found.length) > 0.0:
        return None
    noise = _NOISE_PX / sqrt(intrinsics.fx_px * intrinsics.fy_px)
    return FacePose(p, R, found.length, turn_sd_rad(norm(p), noise))


def _front_seen(points: list[list[float]]) -> bool:
    """Return whether eyes and mouth run round the way they do on a face seen from its front.

    The sign of a projected triangle tells exactly which side of its plane is seen; one
    without any size tells nothing.
    """
    (ax, ay), (bx, by), (nx, ny), (cx, cy), (dx, dy) = points
    if not isfinite(ax + ay + bx + by + nx + ny + cx + cy + dx + dy):
        return False
    down_x, down_y = 0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by)
    return (bx - ax) * down_y - (by - ay) * down_x > _LEAST_AREA_PX2


def _rays(points: list[list[float]], lens: Intrinsics) -> list[Vec3]:
    """Return the directions through pixels, with z = 1 and distortion undone."""
    if lens.distorts:
        return [(x, y, z) for x, y, z in rays_through(points, lens).tolist()]
    fx, fy, cx, cy = lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px
    return [((x - cx) / fx, (y - cy) / fy, 1.0) for x, y in points]


def _facing_camera(rays: list[Vec3]) -> Mat3:
    """Turn the camera towards the face and roll it so that the eyes lie level: a rotation.

    Seen so, poses near "looks at me" are small rotations wherever the face appears.
    """
    a, b, c, d, e = rays
    z = unit((a[0] + b[0] + c[0] + d[0] + e[0], a[1] + b[1] + c[1] + d[1] + e[1], 5.0))
    eyes = sub(b, a)
    x = unit(sub(eyes, scale(z, dot(eyes, z))))
    return x, cross(z, x), z


def _seen_from(R_face_camera: Mat3, rays: list[Vec3]) -> Points:
    """Return where rays meet the plane z = 1 of the camera turned towards the face."""
    (a, b, c), (d, e, f), (g, h, i) = R_face_camera
    found = []
    for x, y, _ in rays:  # z is 1
        z = g * x + h * y + i
        found.append(((a * x + b * y + c) / z, (d * x + e * y + f) / z))
    return tuple(found)


def _transposed(R: Mat3) -> Mat3:
    (a, b, c), (d, e, f), (g, h, i) = R
    return (a, d, g), (b, e, h), (c, f, i)


def _face_axes(R: Mat3) -> Mat3:
    """Return a turned face's axes from its turn.

    A face that looks straight into a camera has its left at the image's right, its up at the
    image's up, and what comes out of it comes towards the camera.
    """
    (a, b, c), (d, e, f), (g, h, i) = R
    return (-c, a, -b), (-f, d, -e), (-i, g, -h)

"""Pose of a face from five landmarks in an image.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up.
Camera frame: optical, x right, y down, z forward. Metres; pixels have their centres at
whole numbers.

Five points nearly in one plane determine position and roll well, and yaw and pitch poorly. Faces
also differ, in length and most of all at the mouth: a smile widens it, raises its corners and
draws them back. A rigid face model could explain this only by a nod of ten degrees or more. The
pose is therefore the most probable one. It combines reprojection errors weighted by usual landmark
errors, a mouth of the observed width with corners at the positions of such a smile, priors on their
height and on the face's length, and a weak prior that a detected face is turned towards the camera.
The search starts from a face that looks into the camera, so it ends at the nearer of the two mirror
poses of a flat set of points.
"""

from math import cos, isfinite, radians, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.gaze.angles import compose, cross, dot, norm, rotate_back, scale, sub, transpose, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.intrinsics import rays as rays_through
from gazerig.robot.perception.face_fit import Points, fit_face, nearest_m, turn_sd_rad

# Usual landmark error, without the part that grows with the face.
_NOISE_PX = 1.0
# Twice the area of the triangle of eyes and mouth, below which the points have merged.
_LEAST_AREA_PX2 = 1.0
# A face turned farther than this from the line of sight is not accepted.
_MOST_TURNED_RAD = radians(75.0)


class FacePose(NamedTuple):
    """Position and turn of a face.

    p_camera_m:    tip of the nose
    R_camera_face: face axes in the camera frame
    length:        length of the face relative to the canonical face
    turn_sd_rad:   standard deviation of its turn, the larger of yaw and pitch
    """

    p_camera_m: Vec3
    R_camera_face: Mat3
    length: float
    turn_sd_rad: float = 0.0


def face_pose(landmarks_px: ArrayLike, intrinsics: Intrinsics) -> FacePose | None:
    """Return the pose of an adult face, None if the points are not those of a face from its front.

    Args:
        landmarks_px: (5, 2) in the order of DetectedFace.
        intrinsics: intrinsics of the image.
    """
    array = np.asarray(landmarks_px, dtype=np.float64)
    points: list[list[float]] = array.tolist()
    if array.shape != (5, 2) or not _shows_front(points):
        return None
    rays = _rays(points, intrinsics)
    # Axes of a camera turned to the face and rolled until the eyes are level: poses near "looks at
    # the camera" are small rotations wherever the face appears.
    a, b, c, d, e = rays
    z = unit((a[0] + b[0] + c[0] + d[0] + e[0], a[1] + b[1] + c[1] + d[1] + e[1], 5.0))
    eyes = sub(b, a)
    x = unit(sub(eyes, scale(z, dot(eyes, z))))
    R_face_camera = x, cross(z, x), z
    try:
        found = fit_face(
            _project(R_face_camera, rays),
            _NOISE_PX / sqrt(intrinsics.fx_px * intrinsics.fy_px),
        )
    except (ArithmeticError, ValueError):  # points too far from a face to determine a pose
        return None
    if found is None:
        return None
    p = rotate_back(R_face_camera, found.p_m)
    # A face that looks straight into a camera has its left at the image's right, its up at the
    # image's up, and its outward axis points to the camera.
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = found.R
    axes = (-r02, r00, -r01), (-r12, r10, -r11), (-r22, r20, -r21)
    R = compose(transpose(R_face_camera), axes)
    outwards = (R[0][0], R[1][0], R[2][0])
    if dot(outwards, p) > -cos(_MOST_TURNED_RAD) * norm(p):
        return None
    if not nearest_m(R, p, found.length) > 0.0:
        return None
    noise = _NOISE_PX / sqrt(intrinsics.fx_px * intrinsics.fy_px)
    return FacePose(p, R, found.length, turn_sd_rad(norm(p), noise))


def _shows_front(points: list[list[float]]) -> bool:
    """Return whether eyes and mouth have the orientation of a face seen from its front.

    The sign of the area of a projected triangle shows which side of its plane is visible; a
    degenerate triangle shows neither side.
    """
    (ax, ay), (bx, by), (nx, ny), (cx, cy), (dx, dy) = points
    if not isfinite(ax + ay + bx + by + nx + ny + cx + cy + dx + dy):
        return False
    down_x, down_y = 0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by)
    return (bx - ax) * down_y - (by - ay) * down_x > _LEAST_AREA_PX2


def _rays(points: list[list[float]], lens: Intrinsics) -> list[Vec3]:
    """Return the undistorted directions through pixels, with z = 1."""
    if lens.has_distortion:
        return [(x, y, z) for x, y, z in rays_through(points, lens).tolist()]
    fx, fy, cx, cy = lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px
    return [((x - cx) / fx, (y - cy) / fy, 1.0) for x, y in points]


def _project(R_face_camera: Mat3, rays: list[Vec3]) -> Points:
    """Return the intersections of rays with the plane z = 1 of the camera turned to the face."""
    (a, b, c), (d, e, f), (g, h, i) = R_face_camera
    found = []
    for x, y, _ in rays:  # z is 1
        z = g * x + h * y + i
        found.append(((a * x + b * y + c) / z, (d * x + e * y + f) / z))
    return tuple(found)

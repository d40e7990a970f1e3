"""Reading of a dense face mesh: pose, gaze of the eyes, lids and lips.

The pose is the similarity that maps a rigid part of an average face (nose, forehead, temples,
cheekbones; not mouth, jaw or brows) onto the mesh. The network estimates the mesh's third
coordinate in the scale of the other two, along the line of sight. The position follows from the
points in the image. An eye's line of sight runs from the centre of the eyeball, which is behind the
midpoint between the corners of the lids, through the centre of the iris.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up.
"""

from math import hypot, radians, sqrt

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import FaceMesh, FaceSigns
from gazerig.gaze.types import Floats, Vec3, vec
from gazerig.robot.model.face_geometry import PUPIL_DISTANCE_M
from gazerig.robot.model.intrinsics import rays
from gazerig.robot.perception.face_pose import FacePose

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

"""Rotations and directions for whole arrays of times. x ahead, y left, z up; see gaze.types."""

import numpy as np

from gazerig.gaze.types import Floats


def yaw_pitch_roll(yaw: Floats, pitch: Floats, roll: Floats | float = 0.0) -> Floats:
    """Return rotations (n, 3, 3): Rz(yaw) Ry(-pitch) Rx(roll), pitch + up, rad."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    rows = [
        [cy * cp, -sy * cr - cy * sp * sr, sy * sr - cy * sp * cr],
        [sy * cp, cy * cr - sy * sp * sr, -cy * sr - sy * sp * cr],
        [sp, cp * sr, cp * cr],
    ]
    shape = np.broadcast(*(one for row in rows for one in row)).shape
    out = np.empty((*shape, 3, 3))
    for i, row in enumerate(rows):
        for j, one in enumerate(row):
            out[..., i, j] = one
    return out


def rotate_vectors(R: Floats, v: Floats) -> Floats:
    """Rotate vectors (n, 3) or one vector (3,) by rotations (n, 3, 3)."""
    return np.asarray((R @ np.asarray(v)[..., None])[..., 0])


def unit(v: Floats) -> Floats:
    """Return directions of vectors (n, 3)."""
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9))


def dot(a: Floats, b: Floats) -> Floats:
    """Return inner products of rows (n, 1)."""
    return np.asarray((a * b).sum(axis=-1, keepdims=True))


def axes_along(z: Floats, x_wanted: Floats) -> Floats:
    """Return rotations with a given z axis and an x axis as near as possible to a direction."""
    up = unit(z)
    ahead = unit(x_wanted - dot(x_wanted, up) * up)
    return np.stack((ahead, np.cross(up, ahead), up), axis=-1)


def yaw_of(v: Floats) -> Floats:
    """Return the yaw of directions."""
    return np.asarray(np.arctan2(v[..., 1], v[..., 0]))


def pitch_of(v: Floats) -> Floats:
    """Return the elevation of directions."""
    return np.asarray(np.arctan2(v[..., 2], np.hypot(v[..., 0], v[..., 1])))


def wrap_angle(angle: Floats) -> Floats:
    """Return angles in -pi..pi."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def limit_angle(v: Floats, axis: Floats, most_rad: float) -> Floats:
    """Return directions, turned towards an axis if they are farther from it than an angle."""
    aside = v - dot(v, axis) * axis
    angle = np.arctan2(np.linalg.norm(aside, axis=-1, keepdims=True), dot(v, axis))
    kept = np.minimum(angle, most_rad)
    return np.asarray(np.cos(kept) * axis + np.sin(kept) * unit(aside))


def quaternions(R: Floats) -> Floats:
    """Return rotations (n, 3, 3) as quaternions (n, 4), w first, of one sign over time."""
    from scipy.spatial.transform import Rotation  # 24 MB, not needed without motion

    # The check for rotations takes 6/7 of the time.
    q = Rotation.from_matrix(R, assume_valid=True).as_quat(scalar_first=True)
    flips = np.where((q[1:] * q[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    q[1:] *= np.cumprod(flips)[:, None]
    return np.asarray(q)


def rotation_matrix(quat: Floats) -> Floats:
    """Return the rotation (3, 3) of a unit quaternion (4,), w first."""
    w, x, y, z = quat.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_vector(R: Floats) -> Floats:
    """Return the rotation vector (3,) of a rotation (3, 3) of less than half a turn."""
    sines = 0.5 * (R - R.T)[(2, 0, 1), (1, 2, 0)]
    sine = float(np.linalg.norm(sines))
    angle = np.arctan2(sine, 0.5 * (np.trace(R) - 1.0))
    return np.asarray(sines * (angle / sine if sine > 0.0 else 1.0))


def two_bones(
    start: Floats, end: Floats, upper_m: float, lower_m: float, pole: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the joint between two bones, the end that they reach, and the normal of their plane.

    Args:
        start: upper end of the upper bone (n, 3).
        end: desired end of the lower bone (n, 3); moved into the reach of the bones.
        upper_m: length of the upper bone.
        lower_m: length of the lower bone.
        pole: direction in which the joint between them points (n, 3).
    """
    way = end - start
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    ahead = way / np.maximum(distance, 1e-9)
    # A joint bends by at most 150 deg.
    least = np.sqrt(upper_m**2 + lower_m**2 - 2.0 * upper_m * lower_m * np.cos(np.radians(30.0)))
    reach = np.clip(distance, least, 0.9995 * (upper_m + lower_m))
    along = (reach**2 + upper_m**2 - lower_m**2) / (2.0 * reach)
    out = np.sqrt(np.maximum(upper_m**2 - along**2, 0.0))
    aside = unit(pole - dot(pole, ahead) * ahead)
    return start + along * ahead + out * aside, start + reach * ahead, np.cross(ahead, aside)

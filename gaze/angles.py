"""Points, directions, great circles and rotations as plain tuples, without numpy.

Frames and signs as in gaze.types: x forward, y left, z up; yaw + left, pitch + up, roll + right ear
down. Radians throughout. Scalar arithmetic, because one numpy call on three numbers costs as much
as most functions here.
"""

from math import asin, atan2, cos, hypot, pi, sin, sqrt

Vec3 = tuple[float, float, float]
Mat3 = tuple[Vec3, Vec3, Vec3]
"""Rows of a rotation matrix."""
Angles2 = tuple[float, float]
"""(yaw, pitch) in radians, yaw + left, pitch + up."""
Angles3 = tuple[float, float, float]
"""(yaw, pitch, roll) in radians, roll + right ear down."""


def wrap(angle_rad: float) -> float:
    """Return an angle wrapped into -pi..pi."""
    return (angle_rad + pi) % (2.0 * pi) - pi


def clip(value: float, most: float) -> float:
    """Return a number clipped to +-``most``."""
    return min(max(value, -most), most)


def add(a: Vec3, b: Vec3) -> Vec3:
    """Return the sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec3, b: Vec3) -> Vec3:
    """Return ``a`` minus ``b``."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec3, factor: float) -> Vec3:
    """Return a vector times a number."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def dot(a: Vec3, b: Vec3) -> float:
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def perpendicular(v: Vec3, way: Vec3) -> Vec3:
    """Return the part of a vector that is perpendicular to a unit vector."""
    return sub(v, scale(way, dot(v, way)))


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return the cross product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vec3) -> float:
    """Return the length of a vector."""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def unit(a: Vec3) -> Vec3:
    """Return the direction of a vector; straight ahead for the zero vector."""
    x, y, z = a
    length = sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return (1.0, 0.0, 0.0)
    return (x / length, y / length, z / length)


def keep_min_distance(point: Vec3, eye: Vec3, least_m: float) -> Vec3:
    """Return a point, moved straight away from the eye if it is nearer than a distance."""
    x, y, z = point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]
    if sqrt(x * x + y * y + z * z) >= least_m:
        return point
    return add(eye, scale(unit((x, y, z)), least_m))


def direction(yaw_pitch_rad: Angles2) -> Vec3:
    """Return the unit vector with a yaw and pitch."""
    yaw, pitch = yaw_pitch_rad
    level = cos(pitch)
    return (level * cos(yaw), level * sin(yaw), sin(pitch))


def yaw_pitch(v: Vec3) -> Angles2:
    """Return the yaw and pitch of a vector of any length."""
    return (atan2(v[1], v[0]), atan2(v[2], hypot(v[0], v[1])))


def angle_between(a: Vec3, b: Vec3) -> float:
    """Return the angle between two vectors of any length, exact also for tiny angles."""
    (ax, ay, az), (bx, by, bz) = a, b
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return atan2(sqrt(x * x + y * y + z * z), ax * bx + ay * by + az * bz)


def along_great_circle(start: Vec3, end: Vec3, fraction: float) -> Vec3:
    """Return the unit vector at a fraction of the arc from one unit vector to another.

    0 gives ``start``, 1 gives ``end``; the path is the shorter arc. Opposite vectors
    have no shortest arc: the turn then goes over the left.
    """
    angle = angle_between(start, end)
    if angle < 1e-9:
        return end if fraction >= 0.5 else start
    axis = unit(cross(start, end)) if angle < pi - 1e-6 else (0.0, 0.0, 1.0)
    return rotate_about_axis(start, axis, angle * fraction)


def offset_direction(way: Vec3, start: Vec3, further_rad: float, aside_rad: float) -> Vec3:
    """Return a direction moved further along its great circle and across it.

    way: unit vector to move; start: unit vector at the start of the great circle
    further_rad: angle beyond ``way``; aside_rad: angle to the left of the path from its centre
    """
    pole = cross(start, way)
    if norm(pole) < 1e-12:
        return way
    axis = unit(pole)
    moved = rotate_about_axis(way, axis, further_rad)
    return rotate_about_axis(moved, cross(moved, axis), -aside_rad)


def rotate_about_axis(v: Vec3, axis: Vec3, angle_rad: float) -> Vec3:
    """Return a vector rotated about a unit axis (Rodrigues' formula)."""
    c, s = cos(angle_rad), sin(angle_rad)
    k = dot(axis, v) * (1.0 - c)
    x = cross(axis, v)
    return (
        v[0] * c + x[0] * s + axis[0] * k,
        v[1] * c + x[1] * s + axis[1] * k,
        v[2] * c + x[2] * s + axis[2] * k,
    )


def turn_about(axis: Vec3, angle_rad: float) -> Mat3:
    """Return the rotation about a unit vector by an angle (Rodrigues' formula)."""
    x, y, z = axis
    c, s = cos(angle_rad), sin(angle_rad)
    d = 1.0 - c
    return (
        (c + x * x * d, x * y * d - z * s, x * z * d + y * s),
        (y * x * d + z * s, c + y * y * d, y * z * d - x * s),
        (z * x * d - y * s, z * y * d + x * s, c + z * z * d),
    )


def shorten_arc(v: Vec3, offset_rad: float, start: Vec3 = (1.0, 0.0, 0.0)) -> Vec3:
    """Return a direction moved back towards another by an angle along the great circle.

    A direction closer than the offset becomes that other one.

    Args:
        v: direction of any length.
        offset_rad: angle of the move.
        start: unit vector towards which it is moved; straight ahead.
    """
    arc = angle_between(start, v)
    if arc <= offset_rad or arc == 0.0:
        return start
    return along_great_circle(start, unit(v), (arc - offset_rad) / arc)


def rotation(head_rad: Angles3) -> Mat3:
    """Return the rotation Rz(yaw) Ry(-pitch) Rx(roll) of a yaw-pitch-roll neck."""
    yaw, pitch, roll = head_rad
    cy, sy = cos(yaw), sin(yaw)
    cp, sp = cos(pitch), sin(pitch)
    cr, sr = cos(roll), sin(roll)
    cy_sp, sy_sp = -cy * sp, -sy * sp
    return (
        (cy * cp, cy_sp * sr - sy * cr, cy_sp * cr + sy * sr),
        (sy * cp, sy_sp * sr + cy * cr, sy_sp * cr - cy * sr),
        (sp, cp * sr, cp * cr),
    )


def angles_of(R: Mat3) -> Angles3:
    """Return the yaw, pitch and roll of a rotation: the inverse of ``rotation``."""
    return (
        atan2(R[1][0], R[0][0]),
        asin(min(1.0, max(-1.0, R[2][0]))),
        atan2(R[2][1], R[2][2]),
    )


def rotate(R: Mat3, v: Vec3) -> Vec3:
    """Return R v: child coordinates to parent coordinates."""
    (a, b, c), (d, e, f), (g, h, i) = R
    x, y, z = v
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def rotate_back(R: Mat3, v: Vec3) -> Vec3:
    """Return R^T v: parent coordinates to child coordinates."""
    (a, b, c), (d, e, f), (g, h, i) = R
    x, y, z = v
    return (a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z)


def transpose(R: Mat3) -> Mat3:
    """Return the transpose of a matrix: the inverse of a rotation."""
    (a, b, c), (d, e, f), (g, h, i) = R
    return (a, d, g), (b, e, h), (c, f, i)


def compose(A: Mat3, B: Mat3) -> Mat3:
    """Return A B."""
    (a, b, c), (d, e, f), (g, h, i) = B
    (p, q, r), (s, t, u), (v, w, x) = A
    return (
        (p * a + q * d + r * g, p * b + q * e + r * h, p * c + q * f + r * i),
        (s * a + t * d + u * g, s * b + t * e + u * h, s * c + t * f + u * i),
        (v * a + w * d + x * g, v * b + w * e + x * h, v * c + w * f + x * i),
    )

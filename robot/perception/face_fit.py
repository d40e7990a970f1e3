"""The most probable pose of a face from five points, by Gauss-Newton steps in plain arithmetic.

Seven numbers are fitted: a rotation, a position and the length of the face. The width of the mouth
over the distance of the eyes hardly depends on the turn of the face. It gives the strength of a
smile, and so the positions of the mouth's corners; their height is free within wide bounds. For
matrices this small, NumPy and OpenCV spend most of their time on calls, and they round differently
on other processors.

Frame: of a camera that looks at the face with its eyes level; x right, y down, z forward. Points
are seen on the plane z = 1.
"""

from math import cos, hypot, radians, sin, sqrt
from typing import NamedTuple

from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.face_geometry import EYES_TO_MOUTH_M, LANDMARKS_FACE_M, PUPIL_DISTANCE_M

Points = tuple[tuple[float, float], ...]
Five = tuple[float, float, float, float, float]
"""Three components of a turn, the distance along the optical axis, and the length."""

# Usual landmark error, as a fraction of the distance between the eyes.
_NOISE_OF_EYES = 0.04
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
# face, one fit
# in a hundred has not converged after 20.
_REMAINS, _MOST_STEPS = 1e-3, 20
_SMALL_TURN_RAD = 1e-4
# Variance of the nose's distance from the middle of the four others, over that of one point.
_OF_FIVE = 1.25

# A face that looks straight into the camera: its left is the image's right, its up the image's
# up. The tip of its nose, the origin, is omitted.
_LANDMARKS_M: tuple[Vec3, ...] = tuple((x, y, z) for x, y, z in LANDMARKS_FACE_M.tolist())
_NOSE_OUT_M = -sum(x for x, _, _ in _LANDMARKS_M) / 4.0
_FRONTAL_M = tuple((y, -z, -x) for i, (x, y, z) in enumerate(_LANDMARKS_M) if i != 2)
_HALF_MOUTH_M = _FRONTAL_M[3][0]
_USUAL_WIDTH = 2.0 * _HALF_MOUTH_M / PUPIL_DISTANCE_M


class FittedFace(NamedTuple):
    """A fitted face.

    R: rotation from a face that looks straight into the camera
    p_m: tip of the nose
    length: length of the face, relative to the canonical face
    """

    R: Mat3
    p_m: Vec3
    length: float


class _Sums(NamedTuple):
    """Weighted sums over the points: the normal equations of one step.

    n_x, n_y: sums of the weights in the rows of x and y; to_x, to_y: of the coefficients there
    products: sums of products of the coefficients: the upper triangle, row by row
    errors: sums of coefficients times errors; errors_x, errors_y: sums of the errors
    """

    n_x: float
    n_y: float
    to_x: Five
    to_y: Five
    products: tuple[float, ...]
    errors: Five
    errors_x: float
    errors_y: float


def fit_face(seen: Points, noise: float) -> FittedFace | None:
    """Return the most probable face, None if the points do not determine one.

    Args:
        seen: right eye, left eye, nose, right and left mouth corner on the plane z = 1.
        noise: usual error of a point on that plane, without the part that grows with the face.
    """
    (ax, ay), (bx, by), nose, (cx, cy), (ex, ey) = seen
    eyes = hypot(bx - ax, by - ay)
    height = hypot(0.5 * (cx + ex - ax - bx), 0.5 * (cy + ey - ay - by))
    variance = noise * noise + (_NOISE_OF_EYES * eyes) ** 2
    # A turn shortens one of the face's two lengths, so the longer one is more reliable.
    away_m = 1.0 / max(eyes / PUPIL_DISTANCE_M, height / EYES_TO_MOUTH_M)
    others = (*seen[:2], *seen[3:])
    # The nose projects from the plane of eyes and mouth: its image position shows the turn.
    aside = nose[0] - 0.25 * (ax + bx + cx + ex), nose[1] - 0.25 * (ay + by + cy + ey)
    per_rad = _NOSE_OUT_M / away_m
    turn: Vec3 = (
        aside[1] * per_rad / (per_rad * per_rad + _OF_FIVE * variance * _PITCH_INFO),
        -aside[0] * per_rad / (per_rad * per_rad + _OF_FIVE * variance * _YAW_INFO),
        0.0,
    )
    width = hypot(ex - cx, ey - cy) / eyes
    # Accepted part of the excess over the usual width; width: relative to the eye distance.
    ratio = width / _USUAL_WIDTH
    unsure = 2.0 * (variance / (eyes * eyes)) * (1.0 / _USUAL_WIDTH**2 + ratio * ratio)
    believed = _WIDTH_SPREAD**2 / (_WIDTH_SPREAD**2 + unsure)
    wider, frontal = 0.0, _FRONTAL_M
    height_weight = variance / (variance + (_MOUTH_HEIGHT_OF_EYES * eyes) ** 2)
    R = rotation_by(turn)
    z = away_m - _NOSE_OUT_M
    x, y, length, before = nose[0] * z, nose[1] * z, 1.0, 0.1
    for _ in range(_MOST_STEPS):
        sums = _sums(nose, others, frontal, height_weight, R, (x, y, z), length)
        step = _step(sums, turn, length, variance)
        if step is None:
            return None
        w0, w1, w2, dz, dl = step
        sx0, sx1, sx2, sx3, sx4 = sums.to_x
        sy0, sy1, sy2, sy3, sy4 = sums.to_y
        dx = (sums.errors_x - (sx0 * w0 + sx1 * w1 + sx2 * w2 + sx3 * dz + sx4 * dl)) / sums.n_x
        dy = (sums.errors_y - (sy0 * w0 + sy1 * w1 + sy2 * w2 + sy3 * dz + sy4 * dl)) / sums.n_y
        turn = _add_turn(turn, (w0, w1, w2))
        R = rotation_by(turn)
        x, y, z, length = x + dx, y + dy, z + dz, length + dl
        if not z > 0.0:  # behind the camera, or not finite
            return None
        shift = max(abs(dx), abs(dy), abs(dz)) / away_m
        # The observed width of the mouth at this pose.
        last, wider = (
            wider,
            (1.0 + wider) * width / _mouth_width(frontal, R, (x, y, z), length) - 1.0,
        )
        wider = believed * min(max(wider, _NARROWEST), _WIDEST)
        frontal = _smile_landmarks(wider)
        moved = max(abs(w0), abs(w1), abs(w2), shift, abs(dl), abs(wider - last))
        if moved * moved < _REMAINS * before:
            return FittedFace(R, (x, y, z), length)
        before = moved
    return None


def _smile_landmarks(wider: float) -> tuple[Vec3, ...]:
    """Return eyes and mouth corners of a frontal face whose mouth is wider by a fraction."""
    right_eye, left_eye, (_, y, z), _ = _FRONTAL_M
    out = wider * _HALF_MOUTH_M
    aside, y, z = _HALF_MOUTH_M + out, y - _UP_OF_OUT * out, z + _BACK_OF_OUT * out
    return right_eye, left_eye, (-aside, y, z), (aside, y, z)


def _mouth_width(frontal: tuple[Vec3, ...], R: Mat3, p_m: Vec3, length: float) -> float:
    """Return the observed width of a mouth relative to the observed distance of the eyes."""
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = R
    seen = []
    for x, y, z in frontal:
        y *= length
        q = 1.0 / (p_m[2] + r20 * x + r21 * y + r22 * z)
        seen.append(
            (
                (p_m[0] + r00 * x + r01 * y + r02 * z) * q,
                (p_m[1] + r10 * x + r11 * y + r12 * z) * q,
            )
        )
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = seen
    return hypot(dx - cx, dy - cy) / hypot(bx - ax, by - ay)


def turn_sd_rad(away_m: float, noise: float) -> float:
    """Return the standard deviation of a face's yaw, which is less certain than its pitch.

    The nose projects from the plane of eyes and mouth, and its image position shows the turn.

    Args:
        away_m: distance of the face.
        noise: as in ``fit_face``.
    """
    per_rad = _NOSE_OUT_M / away_m
    variance = noise * noise + (_NOISE_OF_EYES * PUPIL_DISTANCE_M / away_m) ** 2
    return 1.0 / sqrt(per_rad * per_rad / (_OF_FIVE * variance) + _YAW_INFO)


def rotation_by(turn_rad: Vec3) -> Mat3:
    """Return the rotation by a rotation vector (Rodrigues' formula)."""
    x, y, z = turn_rad
    angle2 = x * x + y * y + z * z
    if angle2 < _SMALL_TURN_RAD**2:
        s, v = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
    else:
        angle = sqrt(angle2)
        s, v = sin(angle) / angle, (1.0 - cos(angle)) / angle2
    xy, xz, yz = v * x * y, v * x * z, v * y * z
    xx, yy, zz = v * x * x, v * y * y, v * z * z
    sx, sy, sz = s * x, s * y, s * z
    return (
        (1.0 - yy - zz, xy - sz, xz + sy),
        (xy + sz, 1.0 - xx - zz, yz - sx),
        (xz - sy, yz + sx, 1.0 - xx - yy),
    )


def nearest_m(R_camera_face: Mat3, p_camera_m: Vec3, length: float) -> float:
    """Return the distance of a face's nearest landmark along the optical axis, metres."""
    x_z, y_z, z_z = R_camera_face[2]
    along = [x * x_z + y * y_z + z * z_z * length for x, y, z in _LANDMARKS_M]
    return p_camera_m[2] + min(along)


def _add_turn(turn: Vec3, w: Vec3) -> Vec3:
    """Return the rotation vector after another small turn, to the second order of both."""
    x, y, z = turn
    a, b, c = w
    return (
        x + a - 0.5 * (y * c - z * b),
        y + b - 0.5 * (z * a - x * c),
        z + c - 0.5 * (x * b - y * a),
    )


def _sums(
    nose: tuple[float, float],
    others: Points,
    frontal: tuple[Vec3, ...],
    height_weight: float,
    R: Mat3,
    p_m: Vec3,
    length: float,
) -> _Sums:
    """Return the normal equations at a pose.

    A point P turned by a small w moves by w x P; a row of the equations is the motion of its image.
    Each point has a row of x, of weight k, and one of y, of weight h.

    Args:
        nose: observed nose.
        others: observed eyes and corners of the mouth.
        frontal: the same points on the face.
        height_weight: weight of the rows of y of the mouth's corners.
        R: rotation of the face.
        p_m: position of the face.
        length: length of the face.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = R
    px, py, pz = p_m
    q = 1.0 / pz
    nx, ny, u, v = q * q, q * q, px * q, py * q
    ex, ey = (nose[0] - u) * q, (nose[1] - v) * q
    x3, y3 = -nx * u, -nx * v
    a33, b3 = nx * (u * u + v * v), -u * ex - v * ey
    x0 = x1 = x2 = x4 = y0 = y1 = y2 = y4 = 0.0
    a00 = a01 = a02 = a03 = a04 = a11 = a12 = a13 = a14 = 0.0
    a22 = a23 = a24 = a34 = a44 = b0 = b1 = b2 = b4 = 0.0
    weights = 1.0, 1.0, height_weight, height_weight
    for (fx, fy, fz), (seen_u, seen_v), weight in zip(frontal, others, weights, strict=True):
        tall = fy * length
        x = r00 * fx + r01 * tall + r02 * fz  # the turned point
        y = r10 * fx + r11 * tall + r12 * fz
        z = r20 * fx + r21 * tall + r22 * fz
        q = 1.0 / (pz + z)
        k, u, v = q * q, (px + x) * q, (py + y) * q
        h = weight * k
        # Coefficients of the turn's first two components and the length, in the row of x and in
        # that of y. Those of its third are -y and x, those of the distance -u and -v.
        c0, c1, c4 = -u * y, z + u * x, fy * (r01 - u * r21)
        d0, d1, d4 = -z - v * y, v * x, fy * (r11 - v * r21)
        eu, ev = (seen_u - u) * q, weight * (seen_v - v) * q  # the weighted errors
        kc0, kc1, kc2, kc3, kc4 = k * c0, k * c1, -k * y, -k * u, k * c4
        kd0, kd1, kd2, kd3, kd4 = h * d0, h * d1, h * x, -h * v, h * d4
        nx, ny, ex, ey = nx + k, ny + h, ex + eu, ey + ev
        x0, x1, x2, x3, x4 = x0 + kc0, x1 + kc1, x2 + kc2, x3 + kc3, x4 + kc4
        y0, y1, y2, y3, y4 = y0 + kd0, y1 + kd1, y2 + kd2, y3 + kd3, y4 + kd4
        a00 += kc0 * c0 + kd0 * d0
        a01 += kc0 * c1 + kd0 * d1
        a02 += kd0 * x - kc0 * y
        a03 -= kc0 * u + kd0 * v
        a04 += kc0 * c4 + kd0 * d4
        a11 += kc1 * c1 + kd1 * d1
        a12 += kd1 * x - kc1 * y
        a13 -= kc1 * u + kd1 * v
        a14 += kc1 * c4 + kd1 * d4
        a22 += kd2 * x - kc2 * y
        a23 -= kc2 * u + kd2 * v
        a24 += kc2 * c4 + kd2 * d4
        a33 -= kc3 * u + kd3 * v
        a34 += kc3 * c4 + kd3 * d4
        a44 += kc4 * c4 + kd4 * d4
        b0 += c0 * eu + d0 * ev
        b1 += c1 * eu + d1 * ev
        b2 += x * ev - y * eu
        b3 -= u * eu + v * ev
        b4 += c4 * eu + d4 * ev
    products = a00, a01, a02, a03, a04, a11, a12, a13, a14, a22, a23, a24, a33, a34, a44
    to_x, to_y = (x0, x1, x2, x3, x4), (y0, y1, y2, y3, y4)
    return _Sums(nx, ny, to_x, to_y, products, (b0, b1, b2, b3, b4), ex, ey)


def _step(sums: _Sums, turn: Vec3, length: float, variance: float) -> Five | None:
    """Return the most probable step, None if the equations have no solution.

    The steps of x and y are eliminated first: each appears only in its own rows. The prior on faces
    is weighted by the variance of the points.
    """
    a00, a01, a02, a03, a04, a11, a12, a13, a14, a22, a23, a24, a33, a34, a44 = sums.products
    b0, b1, b2, b3, b4 = sums.errors
    x0, x1, x2, x3, x4 = sums.to_x
    y0, y1, y2, y3, y4 = sums.to_y
    ex, ey, over_x, over_y = sums.errors_x, sums.errors_y, 1.0 / sums.n_x, 1.0 / sums.n_y
    pitch, yaw, long = variance * _PITCH_INFO, variance * _YAW_INFO, variance * _LENGTH_INFO
    # Row by row: without x and y, with the prior, minus the rows already solved (LDL^T).
    fx, fy = x0 * over_x, y0 * over_y
    d0 = a00 + pitch - fx * x0 - fy * y0
    a01, a02 = a01 - fx * x1 - fy * y1, a02 - fx * x2 - fy * y2
    a03, a04 = a03 - fx * x3 - fy * y3, a04 - fx * x4 - fy * y4
    # A rotation vector moves with a small turn by that turn and half its product with the vector.
    t0, t1, t2 = turn
    half = 0.5 * (yaw - pitch) * t0 * t1
    b0 = b0 - pitch * t0 + 0.5 * yaw * t1 * t2 - fx * ex - fy * ey
    if not d0 > 0.0:
        return None
    l1, l2, l3, l4 = a01 / d0, a02 / d0, a03 / d0, a04 / d0
    fx, fy = x1 * over_x, y1 * over_y
    d1 = a11 + yaw - fx * x1 - fy * y1 - l1 * a01
    a12 = a12 - fx * x2 - fy * y2 - l1 * a02
    a13, a14 = a13 - fx * x3 - fy * y3 - l1 * a03, a14 - fx * x4 - fy * y4 - l1 * a04
    b1 = b1 - yaw * t1 - 0.5 * pitch * t0 * t2 - fx * ex - fy * ey - l1 * b0
    if not d1 > 0.0:
        return None
    m2, m3, m4 = a12 / d1, a13 / d1, a14 / d1
    fx, fy = x2 * over_x, y2 * over_y
    d2 = a22 - fx * x2 - fy * y2 - l2 * a02 - m2 * a12
    a23 = a23 - fx * x3 - fy * y3 - l2 * a03 - m2 * a13
    a24 = a24 - fx * x4 - fy * y4 - l2 * a04 - m2 * a14
    b2 = b2 - half - fx * ex - fy * ey - l2 * b0 - m2 * b1
    if not d2 > 0.0:
        return None
    n3, n4 = a23 / d2, a24 / d2
    fx, fy = x3 * over_x, y3 * over_y
    d3 = a33 - fx * x3 - fy * y3 - l3 * a03 - m3 * a13 - n3 * a23
    a34 = a34 - fx * x4 - fy * y4 - l3 * a04 - m3 * a14 - n3 * a24
    b3 = b3 - fx * ex - fy * ey - l3 * b0 - m3 * b1 - n3 * b2
    if not d3 > 0.0:
        return None
    o4 = a34 / d3
    fx, fy = x4 * over_x, y4 * over_y
    d4 = a44 + long - fx * x4 - fy * y4 - l4 * a04 - m4 * a14 - n4 * a24 - o4 * a34
    b4 = b4 - long * (length - 1.0) - fx * ex - fy * ey - l4 * b0 - m4 * b1 - n4 * b2 - o4 * b3
    if not d4 > 0.0:
        return None
    s4 = b4 / d4
    s3 = b3 / d3 - o4 * s4
    s2 = b2 / d2 - n3 * s3 - n4 * s4
    s1 = b1 / d1 - m2 * s2 - m3 * s3 - m4 * s4
    return (b0 / d0 - l1 * s1 - l2 * s2 - l3 * s3 - l4 * s4, s1, s2, s3, s4)

"""Covariances of points as plain numbers: symmetric 3 x 3 matrices, and vectors between them.

A symmetric matrix is six numbers, its upper triangle row by row. A NumPy call takes longer than
any of these, and LAPACK rounds otherwise on other processors.
"""

from gazerig.gaze.angles import sub, unit
from gazerig.gaze.types import Vec3

Sym3 = tuple[float, float, float, float, float, float]
"""xx, xy, xz, yy, yz, zz."""
Flat9 = tuple[float, float, float, float, float, float, float, float, float]
"""A 3 x 3 matrix, row by row."""


def sight_cov(p_m: Vec3, p_eye_m: Vec3, across_sd: float, along_sd: float) -> Sym3:
    """Return the covariance of what is known differently across and along the view."""
    x, y, z = unit(sub(p_m, p_eye_m))
    across = across_sd * across_sd
    more = along_sd * along_sd - across
    mx, my = more * x, more * y
    return (across + mx * x, mx * y, mx * z, across + my * y, my * z, across + more * z * z)


def plus(A: Sym3, B: Sym3) -> Sym3:
    """Return the sum of two matrices."""
    return (A[0] + B[0], A[1] + B[1], A[2] + B[2], A[3] + B[3], A[4] + B[4], A[5] + B[5])


def inverse(A: Sym3) -> tuple[Sym3, float]:
    """Return the inverse of a positive matrix, and its determinant."""
    a, b, c, d, e, f = A
    i, j, k = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * i + b * j + c * k
    s = 1.0 / det
    return (i * s, j * s, k * s, (a * f - c * c) * s, (b * c - a * e) * s, (a * d - b * b) * s), det


def applied(A: Sym3, v: Vec3) -> Vec3:
    """Return A v."""
    a, b, c, d, e, f = A
    x, y, z = v
    return (a * x + b * y + c * z, b * x + d * y + e * z, c * x + e * y + f * z)


def squared_length(off: Vec3, A: Sym3) -> float:
    """Return v^T A v: with the inverse of a covariance, the squared Mahalanobis length of v."""
    x, y, z = applied(A, off)
    return off[0] * x + off[1] * y + off[2] * z


def full(A: Sym3) -> Flat9:
    """Return all nine numbers of a symmetric matrix."""
    a, b, c, d, e, f = A
    return (a, b, c, b, d, e, c, e, f)


def transposed(M: Flat9) -> Flat9:
    """Return the transpose."""
    a, b, c, d, e, f, g, h, i = M
    return (a, d, g, b, e, h, c, f, i)


def times(A: Sym3, M: Flat9) -> Flat9:
    """Return A M."""
    a, b, c, d, e, f = A
    p, q, r, s, t, u, v, w, x = M
    return (
        a * p + b * s + c * v, a * q + b * t + c * w, a * r + b * u + c * x,
        b * p + d * s + e * v, b * q + d * t + e * w, b * r + d * u + e * x,
        c * p + e * s + f * v, c * q + e * t + f * w, c * r + e * u + f * x,
    )  # fmt: skip


def less_product(A: Sym3, M: Flat9, N: Flat9) -> Sym3:
    """Return A - M^T N, where that is symmetric."""
    a, b, c, d, e, f, g, h, i = M
    j, k, l_, m, n, o, p, q, r = N
    return (
        A[0] - a * j - d * m - g * p, A[1] - a * k - d * n - g * q, A[2] - a * l_ - d * o - g * r,
        A[3] - b * k - e * n - h * q, A[4] - b * l_ - e * o - h * r, A[5] - c * l_ - f * o - i * r,
    )  # fmt: skip

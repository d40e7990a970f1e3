"""Rotations as unit quaternions, for files and viewers."""

from math import copysign, sqrt

from gazerig.gaze.types import Mat3

Quaternion = tuple[float, float, float, float]
"""w, x, y, z."""


def quaternion(R: Mat3) -> Quaternion:
    """Return a rotation matrix as a unit quaternion with w >= 0."""
    (a, b, c), (d, e, f), (g, h, i) = R
    w, x, y, z = (
        0.5 * sqrt(max(0.0, 1.0 + trace)) for trace in (a + e + i, a - e - i, e - a - i, i - a - e)
    )
    # The largest is exact; the others follow from sums and differences with it.
    largest = max(w, x, y, z)
    if largest == w:
        found = (w, (h - f) / (4 * w), (c - g) / (4 * w), (d - b) / (4 * w))
    elif largest == x:
        found = ((h - f) / (4 * x), x, (b + d) / (4 * x), (c + g) / (4 * x))
    elif largest == y:
        found = ((c - g) / (4 * y), (b + d) / (4 * y), y, (f + h) / (4 * y))
    else:
        found = ((d - b) / (4 * z), (c + g) / (4 * z), (f + h) / (4 * z), z)
    sign = copysign(1.0, found[0])
    w, x, y, z = (sign * value for value in found)
    return w, x, y, z

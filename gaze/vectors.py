"""Points, matrices and angles as plain tuples; light, as short commands import them too."""

Vec3 = tuple[float, float, float]
Mat3 = tuple[Vec3, Vec3, Vec3]
"""Rows of a rotation matrix."""
Angles2 = tuple[float, float]
"""(yaw, pitch) in radians, yaw + left, pitch + up."""
Angles3 = tuple[float, float, float]
"""(yaw, pitch, roll) in radians, roll + right ear down."""

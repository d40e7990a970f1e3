"""Numbers and angles as text files have them."""

from collections.abc import Iterable
from math import atan2, cos, hypot, sin

from gazerig.gaze.types import Mat3


def numbers(values: Iterable[float]) -> str:
    """Return numbers with spaces between, as exact as a float is, none longer than needed."""
    return " ".join(_number(float(value)) for value in values)


def _number(value: float) -> str:
    text = repr(value + 0.0)  # no -0.0
    return text.removesuffix(".0")


def roll_pitch_yaw(R: Mat3) -> tuple[float, float, float]:
    """Return the angles of a rotation about fixed x, y and z axes, in this order (as URDF)."""
    (a, b, c), (d, e, f), (g, _, _) = R
    yaw, pitch = atan2(d, a), atan2(-g, hypot(a, d))
    # From what is left once yaw is undone, so that it holds where pitch is a right angle too.
    s, k = sin(yaw), cos(yaw)
    return atan2(s * c - k * f, k * e - s * b), pitch, yaw

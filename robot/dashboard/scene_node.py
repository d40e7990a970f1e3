"""Place the objects of the page's 3-D scene, and send browsers only what has moved.

Turns are quaternions (w, x, y, z).
"""

from collections.abc import Sequence
from math import atan2, copysign, cos, hypot, sin, sqrt
from typing import Protocol

from gazerig.gaze.types import Floats, Mat3, Vec3

_STILL_M, _STILL = 1e-4, 3e-4
"""What has moved less, in metres and in parts of a quaternion (0.04 deg), stays where it is:
a servo's noise would otherwise be sent to every browser, part by part, 25 times a second."""

Turn = tuple[float, float, float, float]


class Placeable(Protocol):
    """A handle of the scene."""

    position: Floats
    wxyz: Floats


def put(thing: Placeable, p_m: Sequence[float], turn: Turn | None = None) -> None:
    """Move a thing to a place, and turn it where a turn is given."""
    if _off(thing.position.tolist(), p_m) > _STILL_M:
        thing.position = p_m  # type: ignore[assignment]
    if turn is not None:
        turn_to(thing, turn)


def turn_to(thing: Placeable, turn: Turn) -> None:
    """Turn a thing."""
    if _off(thing.wxyz.tolist(), turn) > _STILL:
        thing.wxyz = turn  # type: ignore[assignment]


def quaternion(R: Mat3) -> Turn:
    """Turn a rotation matrix into a quaternion, w >= 0."""
    (a, b, c), (d, e, f), (g, h, i) = R
    w, x, y, z = (
        0.5 * sqrt(max(0.0, 1.0 + s)) for s in (a + e + i, a - e - i, e - a - i, i - a - e)
    )
    return w, copysign(x, h - f), copysign(y, c - g), copysign(z, d - b)


def along(direction: Vec3) -> Turn:
    """Return the turn that lays the x axis along a direction, without roll."""
    x, y, z = direction
    return _turned(atan2(y, x), -atan2(z, hypot(x, y)))


def upright_along(direction: Vec3) -> Turn:
    """Return the turn that lays the z axis along a direction."""
    x, y, z = direction
    return _turned(atan2(y, x), atan2(hypot(x, y), z))


def turned_up(angle_rad: float) -> Turn:
    """Return the turn that lifts the x axis by an angle."""
    return _turned(0.0, -angle_rad)


def _turned(about_z_rad: float, then_about_y_rad: float) -> Turn:
    cz, sz = cos(0.5 * about_z_rad), sin(0.5 * about_z_rad)
    cy, sy = cos(0.5 * then_about_y_rad), sin(0.5 * then_about_y_rad)
    return cz * cy, -sz * sy, cz * sy, sz * cy


def _off(now: Sequence[float], wanted: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(now, wanted, strict=True))

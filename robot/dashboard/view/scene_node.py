"""Place the objects of the page's 3-D scene, and send browsers only what has moved.

Rotations are quaternions (w, x, y, z).
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, sin
from typing import Protocol

from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.model.frames import Quaternion

_STILL_M, _STILL = 1e-4, 3e-4
"""Smallest motion that is sent, in metres and in components of a quaternion (0.04 deg). Without
this
limit, servo noise would be sent to every browser, for each part, 25 times a second."""


class Placeable(Protocol):
    """Handle of a scene node."""

    position: Floats
    wxyz: Floats


def set_pose(thing: Placeable, p_m: Sequence[float], turn: Quaternion | None = None) -> None:
    """Move a node, and rotate it if a rotation is given."""
    if _largest_difference(thing.position.tolist(), p_m) > _STILL_M:
        thing.position = p_m  # type: ignore[assignment]
    if turn is not None and _largest_difference(thing.wxyz.tolist(), turn) > _STILL:
        thing.wxyz = turn  # type: ignore[assignment]


def rotation_to(direction: Vec3) -> Quaternion:
    """Return the rotation of the x axis to a direction, without roll."""
    x, y, z = direction
    return _yaw_then_pitch(atan2(y, x), -atan2(z, hypot(x, y)))


def _yaw_then_pitch(about_z_rad: float, then_about_y_rad: float) -> Quaternion:
    cz, sz = cos(0.5 * about_z_rad), sin(0.5 * about_z_rad)
    cy, sy = cos(0.5 * then_about_y_rad), sin(0.5 * then_about_y_rad)
    return cz * cy, -sz * sy, cz * sy, sz * cy


def _largest_difference(now: Sequence[float], wanted: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(now, wanted, strict=True))

"""First viewpoint of the browsers in the page's scene: a close-up of the head."""

from math import atan, cos, radians, sin
from typing import NamedTuple

from gazerig.gaze.angles import add, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.feed.rig_feed import ShownHead
from gazerig.robot.dashboard.view.head_view import head_dimensions, pivot_m
from gazerig.robot.description.links import CHIN, TOP

_HEAD_SHARE = 0.64
"""Share of the canvas's height that the head fills."""
_UP_RAD = radians(4.0)
"""Elevation, almost straight ahead, so that the head faces the viewer."""
_AWAY = 10.5
"""Distance, in eye distances: near, but without distortion of the nose."""
_MIDDLE: Vec3 = (-0.45, 0.0, 0.5 * (TOP + CHIN) - 0.30)
"""Centre of the view: a little below the centre of the head, so that the neck is visible."""


class View(NamedTuple):
    """Position of the camera, the point in the centre of its view, and its vertical field."""

    position_m: Vec3
    look_at_m: Vec3
    fov_rad: float


def face_view(head: ShownHead) -> View:
    """Return a close-up of the head with its neck straight."""
    measures = head_dimensions(head)
    middle = add(sub(pivot_m(head), measures.pivot_m), measures.scaled(_MIDDLE))
    away_m = _AWAY * measures.interocular_m
    off_m = (away_m * cos(_UP_RAD), 0.0, away_m * sin(_UP_RAD))
    half_height_m = 0.5 * measures.height_m / _HEAD_SHARE
    return View(add(middle, off_m), middle, 2.0 * atan(half_height_m / away_m))

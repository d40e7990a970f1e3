"""Viewpoints of the page's scene: the face, both, over its shoulder, from above."""

from math import atan, cos, radians, sin, tan
from typing import NamedTuple

from gazerig.gaze.angles import add, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.view.head_view import head_dimensions
from gazerig.robot.description.head_shape import CHIN, TOP, HeadMeasures
from gazerig.robot.model.types import Snapshot

FACE, BOTH, SHOULDER, ABOVE = "face", "both", "over its shoulder", "from above"
HALF_WIDTH = 0.84
"""Tangent of half the horizontal field of view that shows rig and visitor: 80 deg."""

HEAD_SHARE = 0.64
"""Share of the canvas's height that the head fills in the view of the face."""
_FACE_RAD, _FACE_UP_RAD = radians(-28.0), radians(4.0)
"""Direction of the view of the face: angles to the head's right and above."""
_FACE_AWAY = 10.5
"""Distance of the view of the face, in eye distances: near, without a distorted nose."""
_FACE_WIDTH = 3.3
"""Smallest visible width, in eye distances."""
_FACE_MIDDLE: Vec3 = (-0.45, 0.0, 0.5 * (TOP + CHIN) - 0.30)
"""Centre of the view: a little below that of the head, so that the neck is visible."""


class View(NamedTuple):
    """Position of the camera and the point in the centre of its view.

    vertical_rad: vertical field of view, None if the horizontal one is given
    least_width: tangent of half the horizontal field that must be in sight
    """

    position_m: Vec3
    look_at_m: Vec3
    vertical_rad: float | None = None
    least_width: float = HALF_WIDTH

    def field_rad(self, aspect: float) -> float:
        """Return the vertical field of view for an aspect ratio of the canvas, rad."""
        across = self.least_width / max(aspect, 1e-3)
        if self.vertical_rad is None:
            return 2.0 * atan(across)
        return 2.0 * atan(max(tan(0.5 * self.vertical_rad), across))


_FIXED = {
    BOTH: View((0.95, -1.42, 0.56), (0.76, 0.0, 0.16)),
    SHOULDER: View((-0.56, -0.20, 0.42), (0.60, 0.06, 0.20)),
    # Above the walls of a room.
    ABOVE: View((-1.5, -2.9, 2.5), (1.0, 0.05, -0.35), least_width=0.62),
}
NAMES = (FACE, *_FIXED)


def view(name: str, snapshot: Snapshot | None = None) -> View:
    """Return a view by its name; that of the face is fitted to the head of a snapshot."""
    return _FIXED[name] if name in _FIXED else _face(snapshot)


def _face(snapshot: Snapshot | None) -> View:
    """Return a close-up of the head with its neck straight."""
    measures, eyes_m = HeadMeasures(), (0.038, 0.0, 0.125)
    if snapshot is not None:
        measures = head_dimensions(snapshot)
        eyes_m = snapshot.p_world_head_m
        if snapshot.p_world_pivot_m is not None:
            eyes_m = sub(snapshot.p_world_pivot_m, measures.pivot_m)
    unit = measures.interocular_m
    middle = add(eyes_m, measures.scaled(_FACE_MIDDLE))
    away = _FACE_AWAY * unit
    level = away * cos(_FACE_UP_RAD)
    off = (level * cos(_FACE_RAD), level * sin(_FACE_RAD), away * sin(_FACE_UP_RAD))
    half_height = 0.5 * measures.height_m / HEAD_SHARE
    return View(
        add(middle, off), middle, 2.0 * atan(half_height / away), 0.5 * _FACE_WIDTH * unit / away
    )

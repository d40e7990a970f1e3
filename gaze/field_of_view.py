"""Visibility of bodies (Mitake et al. 3.3.2): a body is visible if its centre is in an eye's field.

The paper's figure 4 shows the field's angles without numbers; these are the limits of human
perimetry. By the paper's rule a body behind another one is visible too, and so is the robot's own
moving fist. Own bodies are therefore excluded.
"""

from math import atan2, radians, sqrt

from gazerig.gaze.angles import compose, direction, rotate, rotate_back, rotation, sub
from gazerig.gaze.types import Angles2, BodyRows, GazeState, Mat3, Vec3

FIELD_DEG = (100.0, 60.0, 60.0, 75.0)
"""Extent of an eye's field from its line of sight towards temple and nose, up and down."""
_TEMPORAL, _NASAL, _UP, _DOWN = map(radians, FIELD_DEG)


def visible_bodies(bodies: BodyRows, state: GazeState) -> dict[int, str]:
    """Return id and kind of the bodies whose centre is in the field of at least one eye.

    Args:
        bodies: the bodies.
        state: head and eyes.
    """
    left, right = eye_axes(state, left=True), eye_axes(state, left=False)
    return {
        id: kind
        for id, p, kind in zip(bodies.ids, bodies.p_world_m, bodies.kinds, strict=True)
        if _is_inside(p, state.p_world_eye_left_m, left, left=True)
        or _is_inside(p, state.p_world_eye_right_m, right, left=False)
    }


def _is_inside(p: Vec3, p_eye: Vec3, axes: Mat3, left: bool) -> bool:
    """Return whether a point is in the field of one eye."""
    ahead, side, up = rotate_back(axes, sub(p, p_eye))
    off_axis2 = side * side + up * up
    if off_axis2 == 0.0:
        return ahead > 0.0
    # Each quadrant is bounded by a quarter ellipse between its two limits.
    eccentricity = atan2(sqrt(off_axis2), ahead)
    side /= _TEMPORAL if (side > 0.0) is left else _NASAL
    up /= _UP if up > 0.0 else _DOWN
    return eccentricity * eccentricity * (side * side + up * up) <= off_axis2


def eye_axes(state: GazeState, left: bool) -> Mat3:
    """Return R_world_eye of one eye: x along its line of sight, y left, z up."""
    angles: Angles2 = state.eye_left_rad if left else state.eye_right_rad
    return compose(state.R_world_head, rotation((angles[0], angles[1], 0.0)))


def line_of_sight(state: GazeState, left: bool) -> Vec3:
    """Return the unit vector of one eye's line of sight, in the world."""
    return rotate(
        state.R_world_head, direction(state.eye_left_rad if left else state.eye_right_rad)
    )

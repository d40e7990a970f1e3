"""How far beside a point the eyes look."""

from typing import NamedTuple

from gazerig.gaze.angles import add, angle_between, sub
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import GazeState, Vec3


class GazeError(NamedTuple):
    """Angles in radians.

    left, right: between each eye's line of sight and the point
    whole: the larger of both; where one linkage turns both eyes to the sides, that of their
        mean line of sight, from midway between them
    """

    left: float
    right: float
    whole: float


def gaze_error(p_world_m: Vec3, pose: GazeState, converges: bool = True) -> GazeError:
    """Return how far beside a point the eyes look.

    converges: each eye turns to the sides by itself
    """
    left, right = line_of_sight(pose, left=True), line_of_sight(pose, left=False)
    to_left = sub(p_world_m, pose.p_world_eye_left_m)
    to_right = sub(p_world_m, pose.p_world_eye_right_m)
    error_left, error_right = angle_between(left, to_left), angle_between(right, to_right)
    whole = max(error_left, error_right)
    if not converges:
        whole = angle_between(add(left, right), add(to_left, to_right))
    return GazeError(error_left, error_right, whole)

"""Angular error between a point and the lines of sight."""

from typing import NamedTuple

from gazerig.gaze.angles import add, angle_between, sub
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import GazeState, Vec3


class GazeError(NamedTuple):
    """The gaze error in rad.

    Attributes:
        left, right: Angle between each eye's line of sight and the point.
        whole: The larger of both; if one linkage pans both eyes, that of their mean line of
            sight, from midway between them.
    """

    left: float
    right: float
    whole: float


def gaze_error(p_world_m: Vec3, pose: GazeState, converges: bool = True) -> GazeError:
    """Return the angular error between a point and the lines of sight.

    Args:
        p_world_m: The point.
        pose: Poses of head and eyes.
        converges: Whether each eye pans separately.
    """
    left, right = line_of_sight(pose, left=True), line_of_sight(pose, left=False)
    to_left = sub(p_world_m, pose.p_world_eye_left_m)
    to_right = sub(p_world_m, pose.p_world_eye_right_m)
    error_left, error_right = angle_between(left, to_left), angle_between(right, to_right)
    whole = max(error_left, error_right)
    if not converges:
        whole = angle_between(add(left, right), add(to_left, to_right))
    return GazeError(error_left, error_right, whole)

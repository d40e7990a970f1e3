"""Detection of a look at the head: from the gaze of the eyes if it is found, else from the face.

A face that is turned to the head within the cone of the head's own eyes is taken to look at it.
Five landmarks give a turn to some degrees only. So the cone has an inner and an outer edge, and
between them the last result holds; the less certain the turn, the farther apart the edges. If the
turn is less certain than the cone is wide, the result is None.
"""

from math import radians
from typing import NamedTuple, Self

from gazerig.gaze.angles import angle_between
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.track_params import TrackParams

_EYES_HELD_S = 0.12
"""Time for which the eyes' gaze holds if the next frames show a mesh, but not the irises."""
_EYES_SD_RAD = radians(4.0)
"""Usual error of a gaze from images of both eyes."""
_SMOOTHED = 0.6
"""Ratio of the deviation of a track's turn, smoothed over some frames, to that of one frame: a part
of the landmark errors is the same in all of them."""
_EDGE_OF_CONE, _EDGE_OF_SD = 0.2, 0.5
"""Distance of inner and outer edge from the cone: share of the cone, and of the uncertainty."""


class SeenEyes(NamedTuple):
    """State of a person's eyes in the last frame that showed them.

    gaze_world: unit vector of their gaze, None if they were shut
    opening: of the lids over the usual opening
    at_s: capture time of that frame
    """

    gaze_world: Vec3 | None
    opening: float
    at_s: float

    def at(self, t_s: float) -> Self | None:
        """Return the state if it still holds at a time, else None."""
        return self if t_s - self.at_s <= _EYES_HELD_S else None


def angle_off_head_rad(R_world_face: Mat3, gaze_world: Vec3 | None, from_face_m: Vec3) -> float:
    """Return the angle between a person's gaze and the direction to the head.

    Args:
        R_world_face: face axes, x out of the face.
        gaze_world: direction of the gaze of the eyes, None if unknown.
        from_face_m: from the face to the head, world.
    """
    ahead = R_world_face[0][0], R_world_face[1][0], R_world_face[2][0]
    return angle_between(ahead if gaze_world is None else gaze_world, from_face_m)


def looks_at_head(
    params: TrackParams, off_rad: float, turn_sd_rad: float, by_eyes: bool, before: bool | None
) -> bool | None:
    """Return whether a person looks at the head, None if that is too uncertain.

    Args:
        params: half angles of the cones.
        off_rad: angle between the person's gaze and the direction to the head.
        turn_sd_rad: standard deviation of the face's turn in one frame.
        by_eyes: the angle is that of the eyes' gaze, not of the face.
        before: result of the frame before.
    """
    cone = radians(params.eyes_at_head_deg if by_eyes else params.face_at_head_deg)
    sd = _EYES_SD_RAD if by_eyes else _SMOOTHED * turn_sd_rad
    if sd > max(cone, _EYES_SD_RAD):
        return None
    edge = max(_EDGE_OF_CONE * cone, min(_EDGE_OF_SD * sd, 0.5 * cone))
    return off_rad < cone + edge if before else off_rad < cone - edge

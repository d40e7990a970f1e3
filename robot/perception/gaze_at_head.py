"""Whether a person looks at the head: from the eyes where their gaze is found, else the face.

A face that is turned to the head within the cone of the head's own eyes is taken to look at it.
Five landmarks tell a turn to some degrees only, so the cone has an inner and an outer edge, and
between them stays what was found before; both lie the farther off the less certain the turn is.
Where it is less certain than the cone is wide, nothing is said.
"""

from math import radians
from typing import NamedTuple, Self

from gazerig.gaze.angles import angle_between
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.track_params import TrackParams

_EYES_HELD_S = 0.12
"""What the eyes do holds so long where the next frames show a mesh, but not the irises."""
_EYES_SD_RAD = radians(4.0)
"""Usual error of a gaze that a detector finds from images of both eyes."""
_SMOOTHED = 0.6
"""Deviation of a track's turn, smoothed over some frames, over that of one frame: a part of the
errors of landmarks is the same in all of them."""
_EDGE_OF_CONE, _EDGE_OF_SD = 0.2, 0.5
"""Distance of inner and outer edge from the cone: share of the cone, and of the uncertainty."""


class SeenEyes(NamedTuple):
    """What the eyes of a person did in the last frame that showed them.

    gaze_world: unit vector along which they look, None where they were shut
    opening: of the lids over the usual opening
    at_s: capture time of that frame
    """

    gaze_world: Vec3 | None
    opening: float
    at_s: float

    def at(self, t_s: float) -> Self | None:
        """Return them if they hold at a time."""
        return self if t_s - self.at_s <= _EYES_HELD_S else None


def angle_off_head_rad(R_world_face: Mat3, gaze_world: Vec3 | None, from_face_m: Vec3) -> float:
    """Return the angle between where a person looks and the direction to the head.

    Args:
        R_world_face: face axes, x out of the face.
        gaze_world: direction of the gaze of the eyes, None where it is unknown.
        from_face_m: from the face to the head, world.
    """
    ahead = R_world_face[0][0], R_world_face[1][0], R_world_face[2][0]
    return angle_between(ahead if gaze_world is None else gaze_world, from_face_m)


def looks_at_head(
    params: TrackParams, off_rad: float, turn_sd_rad: float, by_eyes: bool, before: bool | None
) -> bool | None:
    """Return whether a person looks at the head, None where that is too uncertain.

    Args:
        params: half angles of the cones.
        off_rad: angle between where the person looks and the head.
        turn_sd_rad: standard deviation of the face's turn in one frame.
        by_eyes: the angle is that of the eyes' gaze, not of the face.
        before: what was found from the frame before.
    """
    cone = radians(params.eyes_at_head_deg if by_eyes else params.face_at_head_deg)
    sd = _EYES_SD_RAD if by_eyes else _SMOOTHED * turn_sd_rad
    if sd > max(cone, _EYES_SD_RAD):
        return None
    edge = max(_EDGE_OF_CONE * cone, min(_EDGE_OF_SD * sd, 0.5 * cone))
    return off_rad < cone + edge if before else off_rad < cone - edge

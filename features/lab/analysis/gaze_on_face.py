"""Measured gaze points on a face, in the face's own frame."""

from gazerig.gaze.angles import add, dot, rotate_back, scale, sub
from gazerig.gaze.types import Mat3, Vec3

_ALONG = 0.05
"""Cosine between a line of sight and a face's direction: from 87 deg it is parallel to the face."""


def gaze_point_on_face(
    p_world_eye_m: Vec3, direction_world: Vec3, p_world_face_m: Vec3, R_world_face: Mat3
) -> tuple[float, float] | None:
    """Return the intersection of a line of sight with the plane of a face: (y, z) in its frame.

    None if the line is parallel to the plane or points away, or the face is seen from behind.
    """
    out = (R_world_face[0][0], R_world_face[1][0], R_world_face[2][0])
    towards = dot(direction_world, out)
    before = dot(sub(p_world_eye_m, p_world_face_m), out)
    if towards > -_ALONG or before <= 0.0:
        return None
    distance = before / -towards
    meets = add(p_world_eye_m, scale(direction_world, distance))
    _, y, z = rotate_back(R_world_face, sub(meets, p_world_face_m))
    return (y, z)

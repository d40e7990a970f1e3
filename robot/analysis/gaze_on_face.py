"""Measured gaze points on a face, in the face's own frame."""

from gazerig.gaze.angles import add, dot, rotate, rotate_back, scale, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.analysis.summary import cyclopean_direction
from gazerig.robot.control.tick import Tick

_PLANE_M = -0.028
"""Plane between the tip of the nose and the eyes and mouth, along the face's own x axis."""


_ALONG = 0.05
"""Cosine between a line of sight and a face's direction: from 87 deg it is parallel to the face."""


class GazeOnFace:
    """Collects gaze points on the plane of the target face.

    points_face_m: (y, z) to the owner's left and up from the nose; seconds: duration at each
    """

    def __init__(self) -> None:
        self.points_face_m: list[tuple[float, float]] = []
        self.seconds: list[float] = []
        self._last_s: float | None = None

    def update(self, tick: Tick) -> None:
        """Add the tick's point if a face is the target and no saccade is active."""
        before, self._last_s = self._last_s, tick.t_s
        if before is None or tick.target.kind != "face" or tick.gaze.phase == "saccade":
            return
        faces = tick.percept.faces if tick.percept is not None else ()
        face = next((face for face in faces if face.id == tick.target.id), None)
        if face is None:
            return
        elapsed = max(0.0, tick.t_s - tick.target.at_s)
        centre = add(face.p_world_m, scale(face.v_world_m_s, elapsed))
        out = rotate(face.R_world_face, (_PLANE_M, 0.0, 0.0))
        point = gaze_point_on_face(
            tick.pose.p_world_head_m, cyclopean_direction(tick), add(centre, out), face.R_world_face
        )
        if point is not None:
            self.points_face_m.append(point)
            self.seconds.append(tick.t_s - before)


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

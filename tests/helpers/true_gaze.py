"""True gaze errors, from the true position of the person, which only a simulation has."""

from gazerig.gaze.angles import add, angle_between, rotate, rotation, scale, sub, unit, yaw_pitch
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Angles2, GazeState, Vec3
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.sim_mock.scenes.scene import ScenePerson


def true_part(person: ScenePerson, part: str | None) -> Vec3:
    """Return the true position of a part of a person's face; None: the tip of the nose."""
    if part is None:
        return person.p_world_face_m
    R = rotation((*person.face_yaw_pitch_rad, 0.0))
    return add(person.p_world_face_m, rotate(R, PARTS_FACE_M[part]))


def gaze_angles(pose: GazeState) -> Angles2:
    """Return yaw and pitch in the world of the mean of both measured lines of sight."""
    return yaw_pitch(_cyclopean(pose))


def gaze_error_rad(p_world_m: Vec3, pose: GazeState) -> float:
    """Return the angle between the measured gaze and a point, from the midpoint of the eyes."""
    return angle_between(_cyclopean(pose), sub(p_world_m, _middle(pose)))


def _cyclopean(pose: GazeState) -> Vec3:
    return unit(add(line_of_sight(pose, True), line_of_sight(pose, False)))


def _middle(pose: GazeState) -> Vec3:
    return scale(add(pose.p_world_eye_left_m, pose.p_world_eye_right_m), 0.5)

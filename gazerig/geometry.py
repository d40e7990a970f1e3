"""Geometry of a rig: joint angles for a point, and lines of sight for joint angles."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.errors import Refused
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Angles3, GazeCommand, Target, Vec3
from gazerig.params import unknown_text
from gazerig.robot.model.commands import LookAt, check_command
from gazerig.robot.model.kinematics import gaze_error
from gazerig.robot.model.types import JointState
from gazerig.robot.run.models import GazeModels, random_generators, rig_kinematics
from gazerig.robot.run.rig_limits import limits


@dataclass(frozen=True, slots=True)
class JointSolution:
    """Joint angles at which a head comes to rest on a point.

    Attributes:
        joints_rad: angles by name; lids are open, joints that gaze does not move are at 0.
        reachable: both eyes meet the point within a degree.
        error_deg: angle between the point and the line of sight of the worse eye.
    """

    joints_rad: Mapping[str, float]
    reachable: bool
    error_deg: float


@dataclass(frozen=True, slots=True)
class HeadPose:
    """Pose of head and eyes at given joint angles, in the world frame.

    Attributes:
        head_rad: (yaw, pitch, roll).
        head_m: the point midway between the eyes.
        left_eye_m: centre of rotation of the left eye.
        right_eye_m: centre of rotation of the right eye.
        left_sight: unit vector along the left line of sight.
        right_sight: unit vector along the right line of sight.
        lids: opening of the left and right upper lid, 0 shut .. 1 open.
    """

    head_rad: Angles3
    head_m: Vec3
    left_eye_m: Vec3
    right_eye_m: Vec3
    left_sight: Vec3
    right_sight: Vec3
    lids: tuple[float, float]


def inverse(rig: Rig | str, point_m: tuple[float, float, float]) -> JointSolution:
    """Return the joint angles with which head and eyes look at a point; nothing moves.

    The head starts straight ahead and makes its share of the turn; the eyes make the rest. A real
    head that is already turned towards the point may stay in its position.

    Args:
        rig: a rig from ``load_rig``, or the name or path of a rig.
        point_m: metres from the neck base; x ahead, y left, z up.

    Raises:
        Refused: the coordinates are not a point.
        ConfigError: the rig is invalid.
    """
    try:
        check_command(LookAt(point_m))
    except ValueError as error:
        raise Refused(str(error)) from None
    found = _load(rig)
    models = GazeModels(found, random_generators(0))
    kinematics, oculomotor = models.kinematics, models.oculomotor
    target = Target(point_m, (0.0, 0.0, 0.0), 0.0, "point", -1, 1.0, True, None, 1, "asked for")
    head, (left, right) = oculomotor.resting_gaze(target)
    gaze = GazeCommand(head, left, right, 1.0, 1.0, "fixate", False, point_m, 0, 0, 0)
    rows = zip(kinematics.inverse(gaze), limits(found.joints), strict=True)
    angles = tuple([min(max(angle, one.low_rad), one.high_rad) for angle, one in rows])
    at_rest = (0.0,) * len(angles)
    pose = kinematics.forward(JointState(angles, at_rest, at_rest, ()))
    error_deg = degrees(gaze_error(point_m, pose, not kinematics.one_pan))
    joints_rad = dict(zip(kinematics.names, angles, strict=True))
    return JointSolution(joints_rad, error_deg <= 1.0, error_deg)


def forward(rig: Rig | str, joints_rad: Mapping[str, float]) -> HeadPose:
    """Return the pose of head and eyes at joint angles.

    Args:
        rig: a rig from ``load_rig``, or the name or path of a rig.
        joints_rad: angles by joint; the others are 0.

    Raises:
        Refused: the rig has no such joint; the message lists its joints.
        ConfigError: the rig is invalid.
    """
    kinematics = rig_kinematics(_load(rig))
    if strange := [name for name in joints_rad if name not in kinematics.names]:
        raise Refused(unknown_text("joint", strange[0], kinematics.names))
    angles = tuple([float(joints_rad.get(name, 0.0)) for name in kinematics.names])
    at_rest = (0.0,) * len(angles)
    pose = kinematics.forward(JointState(angles, at_rest, at_rest, ()))
    return HeadPose(
        pose.head_rad,
        pose.p_world_head_m,
        pose.p_world_eye_left_m,
        pose.p_world_eye_right_m,
        line_of_sight(pose, left=True),
        line_of_sight(pose, left=False),
        (pose.lid_left, pose.lid_right),
    )


def _load(rig: Rig | str) -> Rig:
    return load_rig(rig) if isinstance(rig, str) else rig

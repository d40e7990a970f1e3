"""Parts of a tick as messages for viewers, named as in Foxglove's message schemas.

Quaternions are x, y, z, w. Frames: world at the neck base, head between the eyes, left_eye
and right_eye with x along the line of sight.
"""

from collections.abc import Sequence
from typing import Any

from msgspec import Struct

from gazerig.gaze.angles import add, compose, norm, rotate, rotation, sub
from gazerig.gaze.types import GazeState, Mat3, Vec3
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import JointState

_INFO = 2
_LINE_LIST = 2
_FACE_M = 0.11  # half the height of a face; it is drawn as a sphere
_Unused = tuple[dict[str, Any], ...]
"""A list that viewers require and that is empty here."""


class Message(Struct, frozen=True):
    """A message, or a part of one."""


class Time(Message, frozen=True):
    """A time since 1970."""

    sec: int
    nsec: int


class Xyz(Message, frozen=True):
    """A vector."""

    x: float
    y: float
    z: float


class Quaternion(Message, frozen=True):
    """A rotation."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class ScenePose(Message, frozen=True):
    """A position and an orientation."""

    position: Xyz
    orientation: Quaternion = Quaternion()


class Color(Message, frozen=True):
    """A color with its opacity."""

    r: float
    g: float
    b: float
    a: float = 1.0


_SKIN, _SIGHT, _AIM = Color(0.95, 0.72, 0.55, 0.7), Color(0.2, 0.6, 1.0), Color(1.0, 0.3, 0.2)
_ORIGIN = ScenePose(Xyz(0.0, 0.0, 0.0))


class CompressedImage(Message, frozen=True):
    """A JPEG, and its exposure in the rig's own time."""

    timestamp: Time
    captured_s: float
    data: bytes
    frame_id: str = "camera"
    format: str = "jpeg"


class Log(Message, frozen=True):
    """A text."""

    timestamp: Time
    message: str
    level: int = _INFO
    name: str = "gazerig"
    file: str = ""
    line: int = 0


class Text(Message, frozen=True):
    """A text as in ROS."""

    data: str


class SingleJoint(Message, frozen=True):
    """A measured joint, rad and rad/s."""

    name: str
    position: float
    velocity: float


class JointStates(Message, frozen=True):
    """All measured joints."""

    timestamp: Time
    joints: list[SingleJoint]


class FrameTransform(Message, frozen=True):
    """The pose of a frame."""

    timestamp: Time
    parent_frame_id: str
    child_frame_id: str
    translation: Xyz
    rotation: Quaternion


class FrameTransforms(Message, frozen=True):
    """The poses of frames."""

    transforms: list[FrameTransform]


class Sphere(Message, frozen=True):
    """A sphere."""

    pose: ScenePose
    size: Xyz
    color: Color


class Line(Message, frozen=True):
    """Pairs of points, joined by lines."""

    points: list[Xyz]
    color: Color
    type: int = _LINE_LIST
    pose: ScenePose = _ORIGIN
    thickness: float = 2.0
    scale_invariant: bool = True
    colors: tuple[Color, ...] = ()
    indices: tuple[int, ...] = ()


class SceneEntity(Message, frozen=True):
    """A drawn thing."""

    timestamp: Time
    spheres: list[Sphere]
    lines: list[Line]
    frame_id: str = "world"
    id: str = "gaze"
    lifetime: Time = Time(0, 0)
    frame_locked: bool = False
    metadata: _Unused = ()
    arrows: _Unused = ()
    cubes: _Unused = ()
    cylinders: _Unused = ()
    triangles: _Unused = ()
    texts: _Unused = ()
    models: _Unused = ()


class SceneUpdate(Message, frozen=True):
    """The drawn things."""

    entities: list[SceneEntity]
    deletions: _Unused = ()


def time_stamp(ns: int) -> Time:
    """Return a time in nanoseconds as a viewer's time stamp."""
    return Time(*divmod(ns, 1_000_000_000))


def joint_states(names: Sequence[str], joints: JointState, at: Time) -> JointStates:
    """Return measured joints."""
    rows = zip(names, joints.position_rad, joints.velocity_rad_s, strict=True)
    return JointStates(at, [SingleJoint(*row) for row in rows])


def transforms(pose: GazeState, at: Time) -> FrameTransforms:
    """Return the measured poses of head and eyes."""
    head = ("head", pose.p_world_head_m, pose.R_world_head)
    eyes = [
        (name, p, R) for name, (p, R) in zip(("left_eye", "right_eye"), _eyes(pose), strict=True)
    ]
    return FrameTransforms(
        [FrameTransform(at, "world", name, Xyz(*p), orientation(R)) for name, p, R in (head, *eyes)]
    )


def scene_message(pose: GazeState, point_m: Vec3, faces: Sequence[Vec3], at: Time) -> SceneUpdate:
    """Return faces, lines of sight and the gaze point."""
    sights: list[Vec3] = []
    for p, R in _eyes(pose):
        sights += [p, add(p, rotate(R, (norm(sub(point_m, p)), 0.0, 0.0)))]
    spheres = [
        *(_sphere(face, 2.0 * _FACE_M, _SKIN) for face in faces),
        _sphere(point_m, 0.02, _AIM),
    ]
    return SceneUpdate([SceneEntity(at, spheres, [Line([Xyz(*p) for p in sights], _SIGHT)])])


def orientation(R: Mat3) -> Quaternion:
    """Return a rotation matrix as a viewer's quaternion."""
    w, x, y, z = quaternion(R)
    return Quaternion(x, y, z, w)


def _eyes(pose: GazeState) -> tuple[tuple[Vec3, Mat3], ...]:
    """Return position and rotation of the left and the right eye."""
    eyes = (
        (pose.p_world_eye_left_m, pose.eye_left_rad),
        (pose.p_world_eye_right_m, pose.eye_right_rad),
    )
    return tuple((p, compose(pose.R_world_head, rotation((*angles, 0.0)))) for p, angles in eyes)


def _sphere(p: Vec3, across_m: float, color: Color) -> Sphere:
    return Sphere(ScenePose(Xyz(*p)), Xyz(across_m, across_m, across_m), color)

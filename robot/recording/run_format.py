"""Topics and schemas of a recorded run: JSON with schemas in MCAP (mcap.dev/spec).

/rig/tick contains everything, exactly. The other topics repeat parts of it in formats that viewers
can draw, named as in Foxglove's message schemas. Quaternions are x, y, z, w. Frames: world at the
neck base, head between the eyes, left_eye and right_eye with x along the line of sight, and
gaze_point.
"""

from collections.abc import Sequence
from typing import Any

import msgspec
from msgspec import Struct

from gazerig.gaze.angles import compose, rotation
from gazerig.gaze.types import GazeState, Vec3
from gazerig.robot.loop.tick import TickRecord
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import JointState

TICK, HEALTH = "/rig/tick", "/rig/health"
FRAME, LOG = "/camera/picture", "/log"
JOINT_STATES, TRANSFORMS = "/joint_states", "/tf"
DESCRIPTION = "/robot_description"
"""URDF of the rig, once at the start: viewers draw it and turn its joints."""

RUN, END = "gazerig.run", "gazerig.end"
"""Names of the metadata records at the beginning and the end."""

Schema = dict[str, Any]


class Health(Struct, frozen=True):
    """The bus's counts since it was opened.

    Attributes:
        errors: Number of errors by kind.
        lost_ticks: Ticks that this recording has lost since its start.
    """

    tx_bytes: int
    rx_bytes: int
    errors: dict[str, int]
    lost_ticks: int


class Time(Struct, frozen=True):
    """A time since 1970."""

    sec: int
    nsec: int


class Xyz(Struct, frozen=True):
    """A vector."""

    x: float
    y: float
    z: float


class Quaternion(Struct, frozen=True):
    """A rotation."""

    x: float
    y: float
    z: float
    w: float


class CompressedImage(Struct, frozen=True):
    """A JPEG, and its exposure in the rig's own time."""

    timestamp: Time
    captured_s: float
    data: bytes
    frame_id: str = "camera"
    format: str = "jpeg"


class Log(Struct, frozen=True):
    """A text; level 2 is information."""

    timestamp: Time
    message: str
    level: int = 2
    name: str = "gazerig"
    file: str = ""
    line: int = 0


class Text(Struct, frozen=True):
    """A text as in ROS."""

    data: str


class SingleJoint(Struct, frozen=True):
    """A measured joint, rad and rad/s."""

    name: str
    position: float
    velocity: float


class JointStates(Struct, frozen=True):
    """All measured joints."""

    timestamp: Time
    joints: list[SingleJoint]


class FrameTransform(Struct, frozen=True):
    """The pose of a frame."""

    timestamp: Time
    parent_frame_id: str
    child_frame_id: str
    translation: Xyz
    rotation: Quaternion


class FrameTransforms(Struct, frozen=True):
    """The poses of frames."""

    transforms: list[FrameTransform]


TYPES: dict[str, tuple[str, type]] = {
    TICK: ("gazerig.Tick", TickRecord),
    HEALTH: ("gazerig.Health", Health),
    LOG: ("foxglove.Log", Log),
    FRAME: ("foxglove.CompressedImage", CompressedImage),
    JOINT_STATES: ("foxglove.JointStates", JointStates),
    TRANSFORMS: ("foxglove.FrameTransforms", FrameTransforms),
    DESCRIPTION: ("std_msgs/String", Text),
}
"""Topic -> name and type of its messages."""


def joint_states(names: Sequence[str], joints: JointState, at: Time) -> JointStates:
    """Return measured joints."""
    rows = zip(names, joints.position_rad, joints.velocity_rad_s, strict=True)
    return JointStates(at, [SingleJoint(*row) for row in rows])


def transforms(pose: GazeState, gaze_point_m: Vec3, at: Time) -> FrameTransforms:
    """Return the measured poses of head and eyes, and the planned gaze point."""
    left, right = (
        compose(pose.R_world_head, rotation((*angles, 0.0)))
        for angles in (pose.eye_left_rad, pose.eye_right_rad)
    )
    frames = (
        ("head", pose.p_world_head_m, pose.R_world_head),
        ("left_eye", pose.p_world_eye_left_m, left),
        ("right_eye", pose.p_world_eye_right_m, right),
        ("gaze_point", gaze_point_m, rotation((0.0, 0.0, 0.0))),
    )
    found = []
    for name, p, R in frames:
        w, x, y, z = quaternion(R)
        found.append(FrameTransform(at, "world", name, Xyz(*p), Quaternion(x, y, z, w)))
    return FrameTransforms(found)


_NUMBER: Schema = {"type": "number"}
_ROWS: Schema = {"type": ["array", "number"]}  # of a NumPy array


def json_schema(kind: type) -> Schema:
    """Return the JSON schema of a type in the form that viewers read: without references."""
    (schema,), parts = msgspec.json.schema_components(
        [kind], schema_hook=lambda array: {"type": "array", "items": _ROWS}, ref_template="{name}"
    )
    return _inline(schema, parts)


def _inline(schema: Schema, parts: dict[str, Schema]) -> Schema:
    schema = parts.get(schema.get("$ref", ""), schema)
    options = [_inline(one, parts) for one in schema.get("anyOf", ())]
    options = [one for one in options if one["type"] != "null"]
    if _NUMBER in options:  # or a whole one
        options = [_NUMBER]
    if len(options) == 1:
        return {**options[0], "type": [options[0]["type"], "null"]}
    made: Schema = {
        key: schema[key]
        for key in ("type", "description", "contentEncoding", "additionalProperties")
        if key in schema
    }
    made.setdefault("type", "object" if options else "string")
    if made["type"] == "object":
        fields = schema.get("properties", {})
        made["properties"] = {name: _inline(field, parts) for name, field in fields.items()}
    elif made["type"] == "array":
        items = schema.get("prefixItems", [schema.get("items", {})])
        made["items"] = _inline(items[0], parts)
    return made

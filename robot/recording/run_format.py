"""Topics and schemas of a recorded run: JSON with schemas in MCAP (mcap.dev/spec).

/rig/tick contains everything, exactly. The other topics repeat parts of it in formats that viewers
can draw, named as in Foxglove's message schemas.
"""

from collections.abc import Sequence
from typing import Any

import msgspec
from msgspec import Struct

from gazerig.robot.loop.tick import TickRecord
from gazerig.robot.model.types import JointState

TICK = "/rig/tick"
FRAME, LOG = "/camera/picture", "/log"
JOINT_STATES = "/joint_states"
DESCRIPTION = "/robot_description"
"""URDF of the rig, once at the start: viewers draw it and turn its joints."""

RUN, END = "gazerig.run", "gazerig.end"
"""Names of the metadata records at the beginning and the end."""

Schema = dict[str, Any]


class Time(Struct, frozen=True):
    """A time since 1970."""

    sec: int
    nsec: int


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


TYPES: dict[str, tuple[str, type]] = {
    TICK: ("gazerig.Tick", TickRecord),
    LOG: ("foxglove.Log", Log),
    FRAME: ("foxglove.CompressedImage", CompressedImage),
    JOINT_STATES: ("foxglove.JointStates", JointStates),
    DESCRIPTION: ("std_msgs/String", Text),
}
"""Topic -> name and type of its messages."""


def joint_states(names: Sequence[str], joints: JointState, at: Time) -> JointStates:
    """Return measured joints."""
    rows = zip(names, joints.position_rad, joints.velocity_rad_s, strict=True)
    return JointStates(at, [SingleJoint(*row) for row in rows])


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

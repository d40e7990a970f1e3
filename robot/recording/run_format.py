"""Topics and schemas of a recorded run: JSON with schemas in MCAP (mcap.dev/spec).

/rig/tick contains everything, exactly. The other topics repeat parts of it in formats that viewers
can draw (Foxglove documentation, message schemas).
"""

from typing import Any

import msgspec

from gazerig.robot.loop.tick import TickRecord
from gazerig.robot.recording import viewer_messages as viewers

TICK, HEALTH = "/rig/tick", "/rig/health"
FRAME, LOG = "/camera/picture", "/log"
JOINT_STATES, TRANSFORMS, SCENE = "/joint_states", "/tf", "/scene"
DESCRIPTION = "/robot_description"
"""URDF of the rig, once at the start: viewers draw it and turn its joints."""

RUN, END = "gazerig.run", "gazerig.end"
"""Names of the metadata records at the beginning and the end."""

Schema = dict[str, Any]


class Health(msgspec.Struct, frozen=True):
    """The bus's counts since it was opened.

    Attributes:
        errors: Number of errors by kind.
        lost_ticks: Ticks that this recording has lost since its start.
    """

    tx_bytes: int
    rx_bytes: int
    errors: dict[str, int]
    lost_ticks: int


TYPES: dict[str, tuple[str, type]] = {
    TICK: ("gazerig.Tick", TickRecord),
    HEALTH: ("gazerig.Health", Health),
    LOG: ("foxglove.Log", viewers.Log),
    FRAME: ("foxglove.CompressedImage", viewers.CompressedImage),
    JOINT_STATES: ("foxglove.JointStates", viewers.JointStates),
    TRANSFORMS: ("foxglove.FrameTransforms", viewers.FrameTransforms),
    SCENE: ("foxglove.SceneUpdate", viewers.SceneUpdate),
    DESCRIPTION: ("std_msgs/String", viewers.Text),
}
"""Topic -> name and type of its messages."""


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

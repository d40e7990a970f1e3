"""Topics and schemas of a recorded run: JSON with schemas in MCAP (mcap.dev/spec).

/rig/tick and /rig/percept contain everything, exactly. The other topics repeat parts of it in
formats that viewers can draw (Foxglove documentation, message schemas).
"""

import dataclasses
from types import UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np

from gazerig.gaze.types import Percept
from gazerig.robot.control.tick_stream import TickRow

TICK, PERCEPT, HEALTH = "/rig/tick", "/rig/percept", "/rig/health"
FRAME, LOG, ORDER = "/camera/picture", "/log", "/rig/order"
JOINT_STATES, TRANSFORMS, SCENE = "/joint_states", "/tf", "/scene"
DESCRIPTION = "/robot_description"
"""URDF of the rig, once at the start: viewers draw it and turn its joints."""

RUN, END = "gazerig.run", "gazerig.end"
"""Names of the metadata records at the beginning and the end."""

UNUSED = ("metadata", "arrows", "cubes", "cylinders", "triangles", "texts", "models")
"""Parts of a scene's entity that viewers require and that are empty here."""

Schema = dict[str, Any]


class Message(NamedTuple):
    """A message of the recording: topic, time since the first tick, JSON."""

    topic: str
    at_s: float
    data: dict[str, Any]


def _object(**properties: Schema) -> Schema:
    return {"type": "object", "properties": properties}


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _describe(schema: Schema, description: str) -> Schema:
    return {**schema, "description": description}


_NUMBER: Schema = {"type": "number"}
_MAYBE: Schema = {"type": ["number", "null"]}
_WHOLE: Schema = {"type": "integer"}
_YES: Schema = {"type": "boolean"}
_JSON_TYPES = {float: "number", int: "integer", bool: "boolean", str: "string"}
_TEXT: Schema = {"type": "string"}
_NUMBERS, _TEXTS = _list(_NUMBER), _list(_TEXT)
_TIME = _object(sec=_WHOLE, nsec=_WHOLE)
_XYZ = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object(position=_XYZ, orientation=_TURN)
_ORDER: Schema = {"type": "object", "properties": {"do": _TEXT}}

_DESCRIPTIONS = {
    "t_s": "the rig's own time, s",
    "dt_s": "since the previous tick, s",
    "joints": "measured angles, in the order of guard_result.joints",
    "pose": "measured poses of head and eyes; yaw + left, pitch + up; lids 0 shut .. 1 open",
    "percept": "number of the /rig/percept that this tick used",
    "target": "gaze target and its reason, with the highest saliences term by term",
    "gaze": "output of the gaze models",
    "desired_rad": "desired joint angles; in guard_result null if equal to the tick's",
    "guard_result": "output of the guard",
    "measured": "false: the servo has no feedback and this is its goal, moved at known speeds; "
    "empty: all are measured",
    "stopped": "reason for a stop",
    "controlled_by": "client that controls gaze or joints, and its command",
    "client_control": "the newest command of a client; omitted before the first",
    "tracks": "tracks that play, and the last ones that have ended; omitted before the first",
    "conversation": "state that a voice agent reports; omitted before the first",
    "plan": "choice of the action planner and its reason; omitted without a planner",
    "is_lost": "it is not visible and the gaze is on its last position; omitted if visible",
    "before": "further reports of the machine since the previous tick",
    "looks_at_head": "null: too uncertain",
    "gaze_world": "null: the detector does not find the gaze of the eyes",
    "eye_opening": "of the lids, as a ratio of the usual; null: not found",
    "mouth_opening_m": "gap between the lips; null: not found",
    "speaks": "null: no mouth is found",
    "scene": "number of scene cuts since the start",
}
"""Descriptions of fields by name."""


def type_schema(kind: Any) -> Schema:
    """Return the JSON schema of a value of a type: classes with fields are objects.

    Args:
        kind: a number, text, list, tuple, NumPy array, optional type, or class with fields.
    """
    named = any(hasattr(kind, one) for one in ("_fields", "__struct_fields__"))
    if named or dataclasses.is_dataclass(kind):
        fields = {
            name: _describe(type_schema(of), text)
            if (text := _DESCRIPTIONS.get(name))
            else type_schema(of)
            for name, of in get_type_hints(kind).items()
        }
        return _object(**fields)
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):  # of a type and None
        schema = type_schema(inner[0])
        return {**schema, "type": [schema["type"], "null"]}
    if origin is np.ndarray:
        return {"type": "array"}
    if origin in (tuple, list):
        return _list(type_schema(inner[0]))
    return {"type": _JSON_TYPES.get(kind, "string" if origin is Literal else "object")}


_TICK = type_schema(TickRow)
_TICK["description"] = (
    "one tick of the control loop; frames: world at the neck base, x forward, y left, z up"
)
_TICK["properties"]["guard_result"]["properties"]["desired_rad"]["type"] = ["array", "null"]
_TICK["properties"]["commands"]["items"] = _ORDER
for _unwritten in ("command_is_desired", "parking"):
    del _TICK["properties"][_unwritten]
_PERCEPT = {
    **_object(number=_WHOLE, **type_schema(Percept)["properties"]),
    "description": "content of one frame in world coordinates, by the head's pose at its capture",
}
_HEALTH = _describe(
    _object(
        tx_bytes=_WHOLE, rx_bytes=_WHOLE,
        errors=_describe({"type": "object", "additionalProperties": _WHOLE}, "kind -> count"),
        temperature_c=_list(_MAYBE), voltage_v=_list(_MAYBE), load=_NUMBERS, fault=_TEXTS,
        lost_ticks=_describe(_WHOLE, "ticks that this recording has lost since its start"),
    ),
    "bus counts since it was opened, and the servos in the order of /joint_states' names",
)  # fmt: skip
_LINE = _object(
    timestamp=_TIME, level=_WHOLE, message=_TEXT, name=_TEXT, file=_TEXT, line=_WHOLE
)  # fmt: skip
_IMAGE = _object(
    timestamp=_TIME, frame_id=_TEXT, data={"type": "string", "contentEncoding": "base64"},
    format=_TEXT, captured_s=_describe(_NUMBER, "exposure in the rig's own time, s"),
)  # fmt: skip
_STATES = _object(
    timestamp=_TIME,
    joints=_list(_object(name=_TEXT, position=_NUMBER, velocity=_NUMBER)),
)
_FRAMES = _object(transforms=_list(_object(
    timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_XYZ, rotation=_TURN,
)))  # fmt: skip
_ENTITIES = _object(
    deletions=_list(_object(timestamp=_TIME, type=_WHOLE, id=_TEXT)),
    entities=_list(_object(
        timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_TIME, frame_locked=_YES,
        spheres=_list(_object(pose=_POSE, size=_XYZ, color=_COLOUR)),
        lines=_list(_object(
            type=_WHOLE, pose=_POSE, thickness=_NUMBER, scale_invariant=_YES, points=_list(_XYZ),
            color=_COLOUR, colors=_list(_COLOUR), indices=_list(_WHOLE),
        )),
        **{kind: _list({"type": "object"}) for kind in UNUSED},
    )),
)  # fmt: skip

SCHEMAS: dict[str, tuple[str, Schema]] = {
    TICK: ("gazerig.Tick", _TICK),
    PERCEPT: ("gazerig.Percept", _PERCEPT),
    HEALTH: ("gazerig.Health", _HEALTH),
    ORDER: ("gazerig.Order", _ORDER),
    LOG: ("foxglove.Log", _LINE),
    FRAME: ("foxglove.CompressedImage", _IMAGE),
    JOINT_STATES: ("foxglove.JointStates", _STATES),
    TRANSFORMS: ("foxglove.FrameTransforms", _FRAMES),
    SCENE: ("foxglove.SceneUpdate", _ENTITIES),
    DESCRIPTION: ("std_msgs/String", _object(data=_TEXT)),
}
"""Topic -> name and JSON schema of its messages."""

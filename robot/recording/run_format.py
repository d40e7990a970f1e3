"""Topics and schemas of a recorded run: JSON that describes itself, MCAP (mcap.dev/spec).

/rig/tick and /rig/percept hold everything, exactly; the other topics say parts of it
again in the shapes that viewers draw (Foxglove documentation, message schemas).
"""

from typing import Any, NamedTuple

TICK, PERCEPT, HEALTH = "/rig/tick", "/rig/percept", "/rig/health"
FRAME, LOG, ORDER = "/camera/picture", "/log", "/rig/order"
JOINT_STATES, TRANSFORMS, SCENE = "/joint_states", "/tf", "/scene"

RUN, WORLD, END = "gazerig.run", "gazerig.world", "gazerig.end"
"""Names of the metadata records at the beginning and the end."""

UNUSED = ("metadata", "arrows", "cubes", "cylinders", "triangles", "texts", "models")
"""Parts of a scene's entity that viewers want to find, and that are empty here."""

Schema = dict[str, Any]


class Message(NamedTuple):
    """One message to be written: topic, time since the first tick, JSON."""

    topic: str
    at_s: float
    data: dict[str, Any]


def _object(**properties: Schema) -> Schema:
    return {"type": "object", "properties": properties}


def _list(items: Schema, says: str = "") -> Schema:
    return {"type": "array", "items": items, **({"description": says} if says else {})}


def _says(schema: Schema, says: str) -> Schema:
    return {**schema, "description": says}


_NUMBER: Schema = {"type": "number"}
_MAYBE: Schema = {"type": ["number", "null"]}
_WHOLE: Schema = {"type": "integer"}
_YES: Schema = {"type": "boolean"}
_MAYBE_YES: Schema = {"type": ["boolean", "null"]}
_MAYBE_NUMBERS: Schema = {"type": ["array", "null"], "items": {"type": "number"}}
_TEXT: Schema = {"type": "string"}
_NUMBERS, _TEXTS = _list(_NUMBER), _list(_TEXT)
_TIME = _object(sec=_WHOLE, nsec=_WHOLE)
_XYZ = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_TURN = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object(position=_XYZ, orientation=_TURN)
_MATRIX = _list(_NUMBERS, "rows")

_JOINTS = _object(
    position_rad=_NUMBERS, velocity_rad_s=_NUMBERS, measured_s=_NUMBERS, missing=_TEXTS,
    torque=_list(_YES), fault=_TEXTS, load=_NUMBERS, temperature_c=_list(_MAYBE),
    voltage_v=_list(_MAYBE), rearmed=_list(_YES),
    measured=_says(_list(_YES), "false: its servo tells nothing, this is its goal moved by known "
                   "speeds; empty: all are measured"),
)  # fmt: skip
_SALIENCE = _object(
    id=_WHOLE, kind=_TEXT, translation=_NUMBER, looming=_NUMBER, rotation=_NUMBER, onset=_NUMBER,
    rule=_NUMBER, habituation=_NUMBER, total=_NUMBER,
)  # fmt: skip
_TARGET = _object(
    p_world_m=_NUMBERS, v_world_m_s=_NUMBERS, at_s=_NUMBER, kind=_TEXT, id=_WHOLE, salience=_NUMBER,
    top_down=_YES, part={"type": ["string", "null"]}, shift=_WHOLE, why=_TEXT,
    centre_world_m={"type": ["array", "null"], "items": _NUMBER}, saliences=_list(_SALIENCE),
    plan=_says(_TEXT, "what the action planner has chosen and why; left out without a planner"),
)  # fmt: skip
_GAZE_STATE = _object(
    head_rad=_NUMBERS, head_rate_rad_s=_NUMBERS, eye_left_rad=_NUMBERS, eye_right_rad=_NUMBERS,
    R_world_head=_MATRIX, p_world_head_m=_NUMBERS, p_world_eye_left_m=_NUMBERS,
    p_world_eye_right_m=_NUMBERS, lid_left=_NUMBER, lid_right=_NUMBER, lower_left=_NUMBER,
    lower_right=_NUMBER, base_rad=_NUMBERS, base_rate_rad_s=_NUMBERS,
)  # fmt: skip
_GAZE_COMMAND = _object(
    head_rad=_NUMBERS, eye_left_rad=_NUMBERS, eye_right_rad=_NUMBERS, lid_left=_NUMBER,
    lid_right=_NUMBER, phase=_TEXT, blink=_YES, gaze_point_world_m=_NUMBERS, saccades=_WHOLE,
    fixations=_WHOLE, blinks=_WHOLE, lower_left=_NUMBER, lower_right=_NUMBER,
    limited=_list(_object(axis=_TEXT, asked_rad=_NUMBER, done_rad=_NUMBER, reason=_TEXT)),
)  # fmt: skip
_VERDICT = _object(
    command_rad=_NUMBERS, level=_TEXT, reasons=_TEXTS,
    wish_rad={"type": ["array", "null"], "items": _NUMBER}, why=_TEXTS, gravest=_TEXTS,
    joints=_says(_TEXTS, "names, in the order of every list of joints"),
)  # fmt: skip
_GESTURE = _object(number=_WHOLE, name=_TEXT, ended=_TEXT, who=_TEXT, since_s=_NUMBER)
_LEAD = _object(
    number=_WHOLE, active=_YES, arrived=_YES, error_rad=_NUMBER, ended=_TEXT,
    by=_says(_TEXT, "person, pointer or joint"), who=_TEXT, what=_TEXT, joints=_TEXTS,
    since_s=_NUMBER,
)  # fmt: skip
_ORDER: Schema = {"type": "object", "properties": {"order": _TEXT}}

_TICK = _says(
    _object(
        t_s=_says(_NUMBER, "the rig's own time, s"),
        dt_s=_says(_NUMBER, "since the tick before, s"),
        joints=_says(_JOINTS, "as measured, in the order of verdict.joints"),
        pose=_says(
            _GAZE_STATE,
            "head and eyes as joints.measured says; yaw + left, pitch + up; "
            "lids 0 shut .. 1 open, 1 where there is none",
        ),
        percept={"type": ["integer", "null"], "description": "number of the /rig/percept in force"},
        target=_says(_TARGET, "where to look and why, the highest saliences term by term"),
        gaze=_says(_GAZE_COMMAND, "what the models ask for"),
        wish_rad=_says(_NUMBERS, "desired joint angles"),
        verdict=_says(_VERDICT, "what the guard let through; wish_rad null: that of the tick"),
        events=_TEXTS,
        orders=_list(_ORDER),
        stopped=_says(_TEXT, "why the robot was stopped"),
        led=_says(_TEXT, "who leads gaze or joints and with what"),
        lead=_says(_LEAD, "the newest lead; left out before the first"),
        gesture=_says(_GESTURE, "the newest gesture; left out before the first"),
        before=_list(_object(what=_TEXT), "what the machine said beside the tick's own reading"),
    ),
    "one tick of the control loop; frames: world at the neck base, x forward, y left, z up",
)
_PERCEPT = _says(
    _object(
        number=_WHOLE,
        captured_s=_NUMBER,
        bodies=_object(
            ids=_list(_WHOLE), kinds=_TEXTS, p_world_m=_MATRIX, v_world_m_s=_MATRIX,
            w_world_rad_s=_MATRIX, radius_m=_NUMBERS,
            pv_cov={"type": ["array", "null"], "items": _MATRIX},
        ),
        faces=_list(_object(
            id=_WHOLE, p_world_m=_NUMBERS, v_world_m_s=_NUMBERS, R_world_face=_MATRIX,
            parts_world_m=_MATRIX, confidence=_NUMBER, distance_from=_TEXT, across_sd_m=_NUMBER,
            along_sd_m=_NUMBER, off_head_rad=_MAYBE,
            looks_at_head=_says(_MAYBE_YES, "null: too uncertain"),
            gaze_world=_says(_MAYBE_NUMBERS, "null: the detector does not find the eyes' gaze"),
            eye_opening=_says(_MAYBE, "of the lids, over the usual; null: not found"),
            mouth_opening_m=_says(_MAYBE, "gap between the lips; null: not found"),
            speaks=_says(_MAYBE_YES, "null: no mouth is found"),
        )),
        scene=_says(_WHOLE, "counts the cuts so far; 0 where it is left out"),
    ),
    "what one frame showed, placed in the world by the head's pose at its capture",
)  # fmt: skip
_HEALTH = _says(
    _object(
        tx_bytes=_WHOLE, rx_bytes=_WHOLE,
        errors=_says({"type": "object", "additionalProperties": _WHOLE}, "kind -> count"),
        temperature_c=_list(_MAYBE), voltage_v=_list(_MAYBE), load=_NUMBERS, fault=_TEXTS,
        lost_ticks=_says(_WHOLE, "ticks that this recording could not keep so far"),
    ),
    "bus counts since it was opened, and the servos in the order of /joint_states' names",
)  # fmt: skip
_LINE = _object(
    timestamp=_TIME, level=_WHOLE, message=_TEXT, name=_TEXT, file=_TEXT, line=_WHOLE
)  # fmt: skip
_IMAGE = _object(
    timestamp=_TIME, frame_id=_TEXT, data={"type": "string", "contentEncoding": "base64"},
    format=_TEXT, captured_s=_says(_NUMBER, "exposure in the rig's own time, s"),
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
}
"""Topic -> name and JSON schema of its messages."""

"""Conversion of a recorded tick and its inputs to JSON and back.

The process that writes the recording makes JSON with every field under its own name. Floats
are restored bit for bit: JSON's shortest form of a float is exact, and NaN and infinity are
written as words.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

import msgspec
import numpy as np

from gazerig.gaze.types import (
    Bodies,
    Face,
    GazeCommand,
    GazeState,
    LimitedAngle,
    Percept,
    Salience,
    Target,
)
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_stream import TickRow
from gazerig.robot.model.commands import AnyCommand, check_command
from gazerig.robot.model.control_source import (
    NO_CLIENT_CONTROL,
    ControlState,
    TrackState,
)
from gazerig.robot.model.conversation import NO_CONVERSATION, ConversationState
from gazerig.robot.model.types import GuardResult, JointAngles, JointState

Json = dict[str, Any]


class TorqueEnabled(NamedTuple):
    """A switch-on of the torque, with the present angles as goals."""

    goals_rad: JointAngles


class MeasuredJoints(NamedTuple):
    """A reading of the joints at ``t_s``."""

    t_s: float
    joints: JointState


class TorqueRefused(NamedTuple):
    """A refused switch-on of the torque, with the reason."""

    why: str


BodyRecord = TorqueEnabled | MeasuredJoints | TorqueRefused
"""Report of the machine between two ticks."""


class TickRecord(NamedTuple):
    """A tick and its further inputs.

    Attributes:
        tick: The tick.
        dt_s: Time since the previous tick, or since the start of the loop.
        before: Reports of the machine since the previous tick, without the tick's own joints.
    """

    tick: Tick
    dt_s: float
    before: tuple[BodyRecord, ...] = ()


_BODY_RECORDS: dict[str, type[BodyRecord]] = {
    "engaged": TorqueEnabled,
    "measured": MeasuredJoints,
    "refused": TorqueRefused,
}
_BODY_RECORD_NAMES = {kind: name for name, kind in _BODY_RECORDS.items()}
_NESTED: dict[str, Any] = {
    "joints": JointState, "pose": GazeState, "target": Target, "gaze": GazeCommand,
    "guard_result": GuardResult,
}  # fmt: skip
_NOTHING = {
    "client_control": msgspec.to_builtins(NO_CLIENT_CONTROL),
    "conversation": msgspec.to_builtins(NO_CONVERSATION),
    "tracks": [],
}
_WORDS = {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}
_ODD = "has_words_for_numbers"
_SHAPES = {"p_world_m": (-1, 3), "v_world_m_s": (-1, 3), "w_world_rad_s": (-1, 3)}


def as_json(row: Sequence[Any], finite: bool = False) -> Json:
    """Return a tick from ``tick_stream.decode_plain`` as JSON.

    Fields without information are omitted: ``guard_result.desired_rad`` if it equals the tick's
    (null), ``client_control``, ``tracks`` and ``conversation`` before the first, ``target.plan``
    without a planner, ``target.is_lost`` of a visible target.

    Args:
        row: The fields of a ``TickRow``.
        finite: Whether all numbers in it are known to be finite.
    """
    finite = finite or _finite(row)
    data: Json = dict(
        zip(TickRow._fields, row if finite else _encode_special_floats(row), strict=True)
    )
    for name, kind in _NESTED.items():
        data[name] = _name_fields(kind, data[name])
    target, gaze = data["target"], data["gaze"]
    target["saliences"] = [_name_fields(Salience, one) for one in target["saliences"]]
    gaze["limited"] = [_name_fields(LimitedAngle, one) for one in gaze["limited"]]
    if data.pop("command_is_desired"):  # in nearly every tick: stored once
        data["guard_result"]["desired_rad"] = None
    for name in ("plan", "is_lost"):
        if not target[name]:
            del target[name]
    for name, nothing in _NOTHING.items():
        if data[name] == nothing:
            del data[name]
    del data["parking"]
    before = [
        {"what": what, **_name_fields(_BODY_RECORDS[what], one)} for what, one in data["before"]
    ]
    if before:
        data["before"] = before
    else:
        del data["before"]
    if not finite:
        data[_ODD] = True
    return data


def from_json(data: Json, percepts: Mapping[int, Percept]) -> TickRecord:
    """Return the tick that ``as_json`` wrote.

    Args:
        data: JSON of the tick.
        percepts: The percepts before it, by number.

    Raises:
        KeyError, TypeError, ValueError: The data is not a tick.
    """
    if data.get(_ODD):
        data = _decode_special_floats(data)
    number, guard_result = data["percept"], data["guard_result"]
    if guard_result["desired_rad"] is None:
        guard_result = {**guard_result, "desired_rad": data["desired_rad"]}
    target = {
        **data["target"], "saliences": tuple([Salience(**s) for s in data["target"]["saliences"]])
    }  # fmt: skip
    gaze = {
        **data["gaze"],
        "limited": tuple([LimitedAngle(**one) for one in data["gaze"]["limited"]]),
    }
    tick = Tick(
        data["t_s"],
        _build(JointState, data["joints"]),
        _build(GazeState, data["pose"]),
        None,
        percepts[number] if number is not None else None,
        _build(Target, target),
        _build(GazeCommand, gaze),
        tuple(data["desired_rad"]),
        _build(GuardResult, guard_result),
        tuple(data["events"]),
        tuple([check_command(one) for one in msgspec.convert(data["commands"], list[AnyCommand])]),
        data["stopped"],
        data["controlled_by"],
        msgspec.convert(data.get("client_control", {}), ControlState),
        msgspec.convert(data.get("tracks", ()), tuple[TrackState, ...]),
        conversation=msgspec.convert(data.get("conversation", {}), ConversationState),
    )
    before = tuple([_body_record(one) for one in data.get("before", ())])
    return TickRecord(tick, data["dt_s"], before)


def percept_as_json(values: Sequence[Any], finite: bool = False) -> Json:
    """Return a percept from ``tick_stream.decode_plain`` as JSON; see ``as_json``."""
    number, captured_s, bodies, faces, scene = values
    data = {
        "captured_s": captured_s,
        "bodies": dict(zip(Bodies.__slots__, bodies, strict=True)),
        "faces": [dict(zip(Face.__slots__, face, strict=True)) for face in faces],
        "scene": scene,
    }
    if finite or _finite(data):
        return {"number": number, **data}
    return {"number": number, **_encode_special_floats(data), _ODD: True}


def percept_from_json(data: Json) -> tuple[int, Percept]:
    """Return the number and the percept.

    Raises:
        KeyError, TypeError, ValueError: The data is not a percept.
    """
    if data.get(_ODD):
        data = _decode_special_floats(data)
    found = data["bodies"]
    arrays = {name: np.array(found[name], float).reshape(to) for name, to in _SHAPES.items()}
    cov = found["pv_cov"]
    bodies = Bodies(
        tuple(found["ids"]),
        tuple(found["kinds"]),
        **arrays,
        radius_m=np.array(found["radius_m"], float),
        pv_cov=None if cov is None else np.array(cov, float).reshape(-1, 6, 6),
    )
    faces = tuple([Face(**{k: _to_tuples(v) for k, v in face.items()}) for face in data["faces"]])
    return data["number"], Percept(data["captured_s"], bodies, faces, data.get("scene", 0))


def _body_record(data: Json) -> BodyRecord:
    """Read a report of the machine."""
    kind = _BODY_RECORDS[data["what"]]
    fields = {name: data[name] for name in kind._fields}
    if kind is MeasuredJoints:
        return MeasuredJoints(fields["t_s"], _build(JointState, fields["joints"]))
    made: BodyRecord = _build(kind, fields)
    return made


def body_record_as_plain(one: BodyRecord) -> tuple[str, Sequence[Any]]:
    """Return a report of the machine: its name and plain values."""
    name = _BODY_RECORD_NAMES[type(one)]
    if isinstance(one, MeasuredJoints):
        return name, (one.t_s, _name_fields(JointState, one.joints))
    return name, one


def _name_fields(kind: Any, values: Sequence[Any]) -> Json:
    """Return a named tuple's values by name."""
    return dict(zip(kind._fields, values, strict=True))


def _build(kind: Any, data: Json) -> Any:
    """Build a named tuple from JSON; fields unknown to this version are ignored."""
    known = kind._fields
    return kind(
        **{k: _to_tuples(v) if type(v) is list else v for k, v in data.items() if k in known}
    )


def _to_tuples(value: Any) -> Any:
    """Convert lists to tuples, recursively."""
    if type(value) is not list:
        return value
    if value and type(value[0]) is list:
        return tuple([_to_tuples(item) for item in value])
    return tuple(value)


def _finite(value: Any) -> bool:
    """Return whether all numbers in a value are finite."""
    if isinstance(value, float):
        return isfinite(value)
    if isinstance(value, tuple | list):
        return all([_finite(item) for item in value])
    return all([_finite(item) for item in value.values()]) if isinstance(value, dict) else True


def _encode_special_floats(value: Any) -> Any:
    """Replace NaN and infinities with {"float": "nan"}, "inf" or "-inf", recursively."""
    if isinstance(value, float) and not isfinite(value):
        return {"float": repr(float(value))}
    if isinstance(value, tuple | list):
        return [_encode_special_floats(item) for item in value]
    return (
        {k: _encode_special_floats(v) for k, v in value.items()}
        if isinstance(value, dict)
        else value
    )


def _decode_special_floats(value: Any) -> Any:
    """Undo ``_encode_special_floats``."""
    if isinstance(value, list):
        return [_decode_special_floats(item) for item in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"float"}:
        return _WORDS[value["float"]]
    return {k: _decode_special_floats(v) for k, v in value.items()}

"""One recorded tick with what else entered it as JSON, and back.

The recording holds JSON with every field under its own name, made by the process that writes it.
Floats come back bit for bit: JSON's shortest writing of a float is exact, and what JSON cannot
write is written in words.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from gazerig.gaze.types import (
    Bodies,
    Face,
    GazeCommand,
    GazeState,
    Limited,
    Percept,
    Salience,
    Target,
)
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_stream import TickRow
from gazerig.robot.model.command_json import from_recording as command_from_json
from gazerig.robot.model.leader import NO_GESTURE, NOBODY_LEADS, GestureState, LeadState
from gazerig.robot.model.types import GuardResult, JointAngles, JointState

Json = dict[str, Any]


class TorqueEnabled(NamedTuple):
    """The torque came on, with the present angles as goals."""

    goals_rad: JointAngles


class MeasuredJoints(NamedTuple):
    """The joints were read, at ``t_s``, beside the reading that every tick begins with."""

    t_s: float
    joints: JointState


class TorqueRefused(NamedTuple):
    """The torque could not be put on; why, in words."""

    why: str


BodyRecord = TorqueEnabled | MeasuredJoints | TorqueRefused
"""What the machine said between two ticks."""


class TickRecord(NamedTuple):
    """A tick, and what entered it beside its own fields.

    dt_s: time since the tick before, or since the loop began
    before: what the machine said since the tick before, other than the tick's own joints
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
    "guard_result": GuardResult, "lead": LeadState, "gesture": GestureState,
}  # fmt: skip
_NOTHING = {"lead": list(NOBODY_LEADS), "gesture": list(NO_GESTURE)}
_WORDS = {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}
_ODD = "has_words_for_numbers"
_SHAPES = {"p_world_m": (-1, 3), "v_world_m_s": (-1, 3), "w_world_rad_s": (-1, 3)}


def as_json(row: Sequence[Any], finite: bool = False) -> Json:
    """Name the fields of a tick as ``tick_stream.decode_plain`` returns them.

    A field that holds nothing new is left out: ``guard_result.desired_rad`` if it equals the
    tick's (null), ``lead`` and ``gesture`` before the first, ``target.plan`` without a planner.

    Args:
        row: the fields of a ``TickRow``.
        finite: all numbers in it are known to be finite.
    """
    finite = finite or _finite(row)
    data: Json = dict(zip(TickRow._fields, row if finite else _worded(row), strict=True))
    for name, kind in _NESTED.items():
        data[name] = _named(kind, data[name])
    target, gaze = data["target"], data["gaze"]
    target["saliences"] = [_named(Salience, one) for one in target["saliences"]]
    gaze["limited"] = [_named(Limited, one) for one in gaze["limited"]]
    if data.pop("as_desired"):  # nearly always: written once
        data["guard_result"]["desired_rad"] = None
    if not target["plan"]:
        del target["plan"]
    for name, nothing in _NOTHING.items():
        if list(data[name].values()) == nothing:
            del data[name]
    del data["parking"]
    before = [{"what": what, **_named(_BODY_RECORDS[what], one)} for what, one in data["before"]]
    if before:
        data["before"] = before
    else:
        del data["before"]
    if not finite:
        data[_ODD] = True
    return data


def from_json(data: Json, percepts: Mapping[int, Percept]) -> TickRecord:
    """Return the tick that ``as_json`` named.

    Args:
        data: what ``as_json`` returned.
        percepts: those read so far, by number.

    Raises:
        KeyError, TypeError, ValueError: the data is none.
    """
    if data.get(_ODD):
        data = _unworded(data)
    number, guard_result = data["percept"], data["guard_result"]
    if guard_result["desired_rad"] is None:
        guard_result = {**guard_result, "desired_rad": data["desired_rad"]}
    target = {
        **data["target"], "saliences": tuple([Salience(**s) for s in data["target"]["saliences"]])
    }  # fmt: skip
    gaze = {**data["gaze"], "limited": tuple([Limited(**one) for one in data["gaze"]["limited"]])}
    tick = Tick(
        data["t_s"],
        _made(JointState, data["joints"]),
        _made(GazeState, data["pose"]),
        None,
        percepts[number] if number is not None else None,
        _made(Target, target),
        _made(GazeCommand, gaze),
        tuple(data["desired_rad"]),
        _made(GuardResult, guard_result),
        tuple(data["events"]),
        tuple([command_from_json(command) for command in data["commands"]]),
        data["stopped"],
        data["led"],
        _made(LeadState, data["lead"]) if "lead" in data else NOBODY_LEADS,
        _made(GestureState, data["gesture"]) if "gesture" in data else NO_GESTURE,
    )
    before = tuple([_body_record(one) for one in data.get("before", ())])
    return TickRecord(tick, data["dt_s"], before)


def percept_as_json(values: Sequence[Any], finite: bool = False) -> Json:
    """Name the fields of a percept as ``tick_stream.decode_plain`` gives them; see ``as_json``."""
    number, captured_s, bodies, faces, scene = values
    data = {
        "captured_s": captured_s,
        "bodies": dict(zip(Bodies.__slots__, bodies, strict=True)),
        "faces": [dict(zip(Face.__slots__, face, strict=True)) for face in faces],
        "scene": scene,
    }
    if finite or _finite(data):
        return {"number": number, **data}
    return {"number": number, **_worded(data), _ODD: True}


def percept_from_json(data: Json) -> tuple[int, Percept]:
    """Return the number and the percept.

    Raises:
        KeyError, TypeError, ValueError: the data is none.
    """
    if data.get(_ODD):
        data = _unworded(data)
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
    faces = tuple([Face(**{k: _tupled(v) for k, v in face.items()}) for face in data["faces"]])
    return data["number"], Percept(data["captured_s"], bodies, faces, data.get("scene", 0))


def _body_record(data: Json) -> BodyRecord:
    """Read one thing that the machine said."""
    kind = _BODY_RECORDS[data["what"]]
    fields = {name: data[name] for name in kind._fields}
    if kind is MeasuredJoints:
        return MeasuredJoints(fields["t_s"], _made(JointState, fields["joints"]))
    made: BodyRecord = _made(kind, fields)
    return made


def plain(one: BodyRecord) -> tuple[str, Sequence[Any]]:
    """Return one thing that the machine said: its name, and plain values."""
    name = _BODY_RECORD_NAMES[type(one)]
    if isinstance(one, MeasuredJoints):
        return name, (one.t_s, _named(JointState, one.joints))
    return name, one


def _named(kind: Any, values: Sequence[Any]) -> Json:
    """Return a named tuple's values by name."""
    return dict(zip(kind._fields, values, strict=True))


def _made(kind: Any, data: Json) -> Any:
    """Return a named tuple made of JSON; fields unknown to this version are left out."""
    known = kind._fields
    return kind(**{k: _tupled(v) if type(v) is list else v for k, v in data.items() if k in known})


def _tupled(value: Any) -> Any:
    """Return JSON's lists as tuples."""
    if type(value) is not list:
        return value
    if value and type(value[0]) is list:
        return tuple([_tupled(item) for item in value])
    return tuple(value)


def _finite(value: Any) -> bool:
    """Return whether JSON can write all numbers in it."""
    if isinstance(value, float):
        return isfinite(value)
    if isinstance(value, tuple | list):
        return all([_finite(item) for item in value])
    return all([_finite(item) for item in value.values()]) if isinstance(value, dict) else True


def _worded(value: Any) -> Any:
    """Write what JSON cannot as {"float": "nan"}, "inf" or "-inf"."""
    if isinstance(value, float) and not isfinite(value):
        return {"float": repr(float(value))}
    if isinstance(value, tuple | list):
        return [_worded(item) for item in value]
    return {k: _worded(v) for k, v in value.items()} if isinstance(value, dict) else value


def _unworded(value: Any) -> Any:
    """Undo ``_worded``."""
    if isinstance(value, list):
        return [_unworded(item) for item in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"float"}:
        return _WORDS[value["float"]]
    return {k: _unworded(v) for k, v in value.items()}

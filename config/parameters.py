"""Parameters of a rig: meaning, bounds, default, and the time at which a change takes effect.

A key is the dotted path of the YAML. Changes by keys are checked like those in a file: errors have
the same texts, and after an error nothing is changed. Pure.

A changed rig shares the unchanged sections with the old one, and only the others are checked and
compared: moving a slider creates ten rigs per second while the control loop runs.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Any

from gazerig.config.bounds import Shape, shape_at, shapes_of, validate
from gazerig.config.export import abbreviate, suggestion_text
from gazerig.config.load import ConfigError, ConfigFault, Entry, entries_at, validate_entries
from gazerig.config.plugin_sections import extend_type
from gazerig.config.rig import GazeConfig, Rig
from gazerig.config.schema import RULES
from gazerig.gaze.types import PARTS
from gazerig.robot.model.commands import Value
from gazerig.robot.model.parameter import Parameter
from gazerig.robot.model.types import order_joints

NEXT_TICK = "next tick"
NEXT_START = "next start"

LIVE_LIMITS = ("min_deg", "max_deg", "max_speed_deg_s", "max_accel_deg_s2")
"""Keys of a joint that a running rig applies."""
_LIVE = (
    "gaze.*", "ranges", "ranges.*", "character", "expression*", "levels.*", "park_deg.*", "guard.*",
    "tracker.*", "loop.rate_hz", "sound.volume", *(f"joints.*.{name}" for name in LIVE_LIMITS),
)  # fmt: skip
"""Keys that a running rig applies."""
_GAZE = frozenset(field.name for field in dataclasses.fields(GazeConfig))
_UNLISTED = ("park_deg", "face_parts_mm")
"""Mappings with entries that a file may omit."""
_LEFT_OUT: dict[str, Value] = {"park_deg": 0.0}
"""Value of an omitted entry; None if it has no value of its own."""


def parameters(rig: Rig, defaults: Rig) -> tuple[Parameter, ...]:
    """Return the parameters of a rig in the order of its file."""
    known = values(defaults)
    leaves = _leaves(_root(rig), rig, (), _unlisted(rig))
    return tuple(
        _parameter(k, s, known[k] if k in known else _at(defaults, k)) for k, s, _ in leaves
    )


def value_of(rig: Rig, key: str) -> Value:
    """Return the value at a dotted key; a mapping for a group.

    Raises:
        gazerig.config.load.ConfigError: the key does not exist; the message lists the existing
            ones.
    """
    value: Any = rig
    for done, step in enumerate(steps := key.split(".")):
        held = _parts(value)
        if held is not None and step in held:
            value = held[step]
            continue
        over = ".".join(steps[:done])
        if step in _unlisted(rig).get(over, ()) and done == len(steps) - 1:
            return _LEFT_OUT.get(over)
        names = tuple(held or ())
        near = suggestion_text(step, names) or ";"
        there = f"available: {', '.join(names)}" if names else f"{over} has no keys"
        raise ConfigError(
            [ConfigFault("", None, key, "", f"unknown key {abbreviate(step)}{near} {there}")]
        )
    found: Value = to_plain(value)
    return found


def values(rig: Rig) -> dict[str, Value]:
    """Return the values of all parameters by key."""
    return {key: value for key, _, value in _leaves(_root(rig), rig, (), _unlisted(rig))}


def values_after(known: Mapping[str, Value], before: Rig, after: Rig) -> dict[str, Value]:
    """Return ``values(after)``; known: ``values(before)``, few of which differ."""
    found = differences(before, after)
    same_entries = all(
        list(getattr(before, over)) == list(getattr(after, over)) for over in _UNLISTED
    ) and all(
        key in known and value is not None and not isinstance(value, Mapping)
        for key, value in found.items()
    )
    return {**known, **found} if same_entries else values(after)


def apply_changes(rig: Rig, changes: Mapping[str, Value]) -> Rig:
    """Return the rig with other values at dotted keys, after checking every rule.

    A mapping is merged over the present one, like a layer of a file. None removes an entry of a
    mapping that cannot contain null.

    Raises:
        gazerig.config.load.ConfigError: lists every fault, as when a file is loaded.
    """
    # Unchanged sections are passed to the validation as they are, as they are checked already.
    data = _unfreeze_paths(rig, [tuple(key.split(".")) for key in changes])
    if not any([_put(_root(rig), data, key, _freeze(value)) for key, value in changes.items()]):
        into, problems = extend_type(Rig, data)
        made, _ = validate(into, data)
        if not problems and made is not None and not any(True for r in RULES for _ in r(made)):
            return made
    # It has a fault: list every fault of every rule.
    data, faults = to_plain(rig), []
    for key, value in changes.items():
        faults += _put(_root(rig), data, key, _freeze(value))
    unnamed = Entry(None, "", 0)  # like an entry of a file without a name
    outcome = validate_entries(Rig, entries_at(data, unnamed), RULES)
    made, found = outcome
    faults += [dataclasses.replace(fault, line=None) for fault in found]
    if faults or made is None:
        raise ConfigError(faults)
    return made


def differences(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes that turn one rig into another: ``changed(before, ...) == after``.

    A removed entry of a mapping has the value None.
    """
    return dict(_iterate_differences(_root(after), before, after, ()))


def flatten_changes(rig: Rig, changes: Mapping[str, Value]) -> dict[str, Value]:
    """Return changes with mappings expanded to their single keys, as in a file."""
    out: dict[str, Value] = {}
    for key, value in changes.items():
        shape = shape_at(_root(rig), key.split("."))
        group = shape is not None and (shape.params is not None or shape.form == "mapping")
        if group and isinstance(value, Mapping):
            out |= flatten_changes(rig, {f"{key}.{step}": item for step, item in value.items()})
        else:
            out[key] = value
    return out


def to_plain(value: Any) -> Any:
    """Return frozen values as dicts, tuples and scalars."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = shapes_of(type(value))
        return {name: to_plain(getattr(value, name)) for name in fields}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(to_plain(item) for item in value)
    return value


def _parts(value: Any) -> dict[str, Any] | None:
    """Return the values one step below a value, None if it has none."""
    if isinstance(value, Mapping):
        return {str(key): item for key, item in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {name: getattr(value, name) for name in shapes_of(type(value))}
    return None


def _unfreeze_paths(value: Any, paths: Sequence[tuple[str, ...]]) -> Any:
    """Return a value with plain dicts along the paths and at their ends; the rest is unchanged."""
    if () in paths:
        return to_plain(value)
    parts = _parts(value) if paths else None
    if parts is None:
        return value
    for step in {path[0] for path in paths} & parts.keys():
        parts[step] = _unfreeze_paths(parts[step], [path[1:] for path in paths if path[0] == step])
    return parts


def _root(rig: Rig) -> Shape:
    """Return the shape of a rig, with the sections of its plug-ins."""
    return Shape("params", params=type(rig))


_Unlisted = Mapping[str, tuple[str, ...]]
"""Key of a mapping -> its possible entries."""


def _unlisted(rig: Rig) -> _Unlisted:
    return {"park_deg": order_joints(rig.joints), "face_parts_mm": PARTS}


def _leaves(
    shape: Shape, value: Any, path: tuple[str, ...], unlisted: _Unlisted
) -> Iterator[tuple[str, Shape, Value]]:
    """Return key, shape and value of every leaf below a position."""
    key = ".".join(path)
    if shape.params is not None and value is not None and value not in shape.choices:
        for name, field in shapes_of(shape.params).items():
            yield from _leaves(field, getattr(value, name), (*path, name), unlisted)
    elif shape.form == "mapping" and shape.inner is not None:
        inner = dataclasses.replace(shape.inner, description=shape.description, unit=shape.unit)
        for step in (*value, *(s for s in unlisted.get(key, ()) if s not in value)):
            yield from _leaves(inner, value.get(step, _LEFT_OUT.get(key)), (*path, step), unlisted)
    else:
        yield key, shape, to_plain(value)


def _parameter(key: str, shape: Shape, default: Value) -> Parameter:
    inner = shape.inner or shape
    while inner.inner is not None:
        inner = inner.inner
    entry = key.rpartition(".")[0]
    choices: tuple[Value, ...] = tuple(inner.choices)  # type: ignore[arg-type]
    return Parameter(
        key,
        entry,
        shape.unit,
        shape.description,
        inner.low,
        inner.high,
        choices,
        "mapping" if shape.form == "params" else shape.form,
        default,
        effect_time(key),
        shape.optional or (entry in _UNLISTED and entry not in _LEFT_OUT),
        shape.length,
        shape.inner.form if shape.inner is not None else None,
    )


@lru_cache(maxsize=1024)
def effect_time(key: str) -> str:
    """Return when a change of a key takes effect."""
    first, _, rest = key.partition(".")
    package = first == "gaze" and rest.partition(".")[0] not in _GAZE - {"chooser"}
    live = any(fnmatchcase(key, pattern) for pattern in _LIVE) and not package
    return NEXT_TICK if live else NEXT_START


def start_note(key: str) -> str:
    """Return " (next start)" if a running rig cannot apply a key, else ""."""
    return f" ({NEXT_START})" if effect_time(key) == NEXT_START else ""


def _at(rig: Rig, key: str) -> Value:
    """Return the value at a key, None if this rig has no such entry."""
    try:
        return value_of(rig, key)
    except ConfigError:
        return None


def _iterate_differences(
    shape: Shape, before: Any, after: Any, path: tuple[str, ...]
) -> Iterator[tuple[str, Value]]:
    if before is after:
        return
    single = (None, *shape.choices)
    if shape.params is not None and before not in single and after not in single:
        for name, field in shapes_of(shape.params).items():
            if hasattr(before, name):
                both = getattr(before, name), getattr(after, name)
                yield from _iterate_differences(field, *both, (*path, name))
            else:  # the section of a new plug-in
                yield ".".join((*path, name)), to_plain(getattr(after, name))
    elif before == after and type(before) is type(after):
        return
    elif shape.form == "mapping" and shape.inner is not None:
        for step in {**before, **after}:
            if step in before and step in after:
                yield from _iterate_differences(
                    shape.inner, before[step], after[step], (*path, step)
                )
            else:
                yield ".".join((*path, step)), to_plain(after.get(step))
    else:
        yield ".".join(path), to_plain(after)


def _put(root: Shape, data: dict[str, Any], key: str, value: Value) -> list[ConfigFault]:
    """Set a value in plain data at a dotted key; return the faults."""
    *over, last = key.split(".")
    held: Any = data
    shape: Shape | None = root
    for step in over:
        if shape is not None:
            shape = shapes_of(shape.params).get(step) if shape.params is not None else shape.inner
        if (
            isinstance(held, dict)
            and shape is not None
            and (held.get(step, {}) is None or (shape.params and held.get(step) in shape.choices))
        ):
            held[step] = {}
        held = held.setdefault(step, {}) if isinstance(held, dict) else None
    if not isinstance(held, dict):
        rule = f"unknown key {abbreviate(last)}; {'.'.join(over)} is a single value"
        return [ConfigFault("", None, key, abbreviate(value), rule)]
    inner = shape.inner if shape is not None and shape.form == "mapping" else None
    if value is None and inner is not None and not inner.optional:
        held.pop(last, None)
    elif isinstance(value, Mapping) and isinstance(held.get(last), dict):
        held[last] = _overlay(held[last], value)
    else:
        held[last] = value
    return []


def _overlay(low: dict[str, Any], high: Mapping[str, Any]) -> dict[str, Any]:
    out = dict(low)
    for key, value in high.items():
        both = isinstance(value, Mapping) and isinstance(out.get(key), dict)
        out[key] = _overlay(out[key], value) if both else value
    return out


def _freeze(value: Any) -> Any:
    """Return a value with lists as tuples and mappings as dicts."""
    if isinstance(value, list | tuple):
        return tuple(_freeze(item) for item in value)
    if isinstance(value, Mapping):
        return {str(key): _freeze(item) for key, item in value.items()}
    return value

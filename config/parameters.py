"""Parameters of a rig: meaning, bounds, default, and the time at which a change takes effect.

A key is the dotted path of the YAML. Changes by keys are checked like those in a file: errors have
the same texts, and after an error nothing is changed. Pure.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Any

from gazerig.config.load import ConfigError, ConfigFault, validate_rules
from gazerig.config.rig import GazeConfig, Rig
from gazerig.config.schema import RULES
from gazerig.config.validation import abbreviate, suggestion_text
from gazerig.params import Declaration, declarations
from gazerig.robot.model.commands import Value
from gazerig.robot.model.parameter import Parameter

NEXT_TICK = "next tick"
NEXT_START = "next start"

LIVE_LIMITS = ("min_deg", "max_deg", "max_speed_deg_s", "max_accel_deg_s2")
"""Keys of a joint that a running rig applies."""
_LIVE = (
    "character",
    "ranges.*",
    "guard.*",
    "tracker.*",
    "sound.device",
    *(f"joints.*.{name}" for name in LIVE_LIMITS),
)
"""Keys that a running rig applies, besides those of gaze; it reads all others when it starts."""


def parameters(rig: Rig, defaults: Rig) -> tuple[Parameter, ...]:
    """Return the parameters of a rig in the order of its file."""
    known = values(defaults)
    leaves = _leaves(Declaration("params", params=Rig), rig, "")
    return tuple(_parameter(key, declared, known.get(key)) for key, declared, _ in leaves)


def value_of(rig: Rig, key: str) -> Value:
    """Return the value at a dotted key; a mapping for a group.

    Raises:
        gazerig.config.load.ConfigError: the key does not exist; the message lists the existing
            ones.
    """
    value: Any = to_plain(rig)
    for done, step in enumerate(steps := key.split(".")):
        names = tuple(value) if isinstance(value, dict) else ()
        if step not in names:
            near = suggestion_text(step, names) or ";"
            there = f"available: {', '.join(names)}"
            there = there if names else f"{'.'.join(steps[:done])} has no keys"
            rule = f"unknown key {abbreviate(step)}{near} {there}"
            raise ConfigError([ConfigFault("", None, key, "", rule)])
        value = value[step]
    found: Value = value
    return found


def values(rig: Rig) -> dict[str, Value]:
    """Return the values of all parameters by key."""
    leaves = _leaves(Declaration("params", params=Rig), rig, "")
    return {key: to_plain(value) for key, _, value in leaves}


def apply_changes(rig: Rig, changes: Mapping[str, Value]) -> Rig:
    """Return the rig with other values at dotted keys, after checking every rule.

    A mapping is merged over the present one, like a layer of a file. None removes an entry of a
    mapping that cannot contain null.

    Raises:
        gazerig.config.load.ConfigError: lists every fault, as when a file is loaded.
    """
    data, faults = to_plain(rig), list[ConfigFault]()
    for key, value in changes.items():
        faults += _put(data, key, to_plain(value))
    outcome = validate_rules(Rig, data, RULES)
    made, found = outcome
    faults += [ConfigFault("", None, ".".join(map(str, v.path)), v.value, v.rule) for v in found]
    if faults or made is None:
        raise ConfigError(faults)
    return made


def differences(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes that turn one rig into another: ``changed(before, ...) == after``.

    A removed entry of a mapping has the value None.
    """
    return {} if before is after else dict(_differences(to_plain(before), to_plain(after), ""))


def flatten_changes(changes: Mapping[str, Value]) -> dict[str, Value]:
    """Return changes with mappings expanded to their single keys, as in a file."""
    out: dict[str, Value] = {}
    for key, value in changes.items():
        if isinstance(value, Mapping) and value:
            out |= flatten_changes({f"{key}.{step}": item for step, item in value.items()})
        else:
            out[key] = value
    return out


def to_plain(value: Any) -> Any:
    """Return frozen values as dicts, tuples and scalars."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {name: to_plain(one) for name, (_, one) in _fields(value).items()}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(to_plain(item) for item in value)
    return value


@lru_cache(maxsize=1024)
def effect_time(key: str) -> str:
    """Return when a change of a key takes effect."""
    first, second, *_ = *key.split("."), ""
    if first == "gaze":  # a package's rule is created with its section, and so is the chooser
        live = second in declarations(GazeConfig) and second != "chooser"
    else:
        live = any(fnmatchcase(key, pattern) for pattern in _LIVE)
    return NEXT_TICK if live else NEXT_START


def start_note(key: str) -> str:
    """Return " (at the next start)" if a running rig does not apply a key, otherwise ""."""
    return " (at the next start)" if effect_time(key) == NEXT_START else ""


def _fields(value: Any) -> dict[str, tuple[Declaration, Any]]:
    """Return the fields of a section with their values, and the sections of plug-ins in it."""
    shown = {
        name: (one, getattr(value, name)) for name, one in declarations(value.__class__).items()
    }
    for name, section in getattr(value, "plugins", {}).items():
        shown[name] = Declaration("params", params=type(section)), section
    return shown


def _leaves(declared: Declaration, value: Any, key: str) -> Iterator[tuple[str, Declaration, Any]]:
    """Yield key, declaration and value of every leaf below a position."""
    start = f"{key}." if key else ""
    if dataclasses.is_dataclass(value):
        for name, (field, inner) in _fields(value).items():
            yield from _leaves(field, inner, f"{start}{name}")
    elif declared.form == "mapping" and declared.inner is not None:
        for step, item in value.items():
            yield from _leaves(declared.inner, item, f"{start}{step}")
    else:
        yield key, declared, value


def _parameter(key: str, declared: Declaration, default: Value) -> Parameter:
    inner = declared.innermost
    return Parameter(
        key,
        key.rpartition(".")[0],
        declared.unit,
        declared.description,
        inner.low,
        inner.high,
        inner.choices,
        "mapping" if declared.form == "params" else declared.form,
        default,
        effect_time(key),
        declared.optional,
        declared.length,
        declared.inner.form if declared.inner is not None else None,
    )


def _differences(before: Any, after: Any, key: str) -> Iterator[tuple[str, Value]]:
    if not (isinstance(before, dict) and isinstance(after, dict)):
        if before != after or type(before) is not type(after):
            yield key, after
        return
    start = f"{key}." if key else ""
    for step in {**before, **after}:
        if step in before and step in after:
            yield from _differences(before[step], after[step], f"{start}{step}")
        else:
            yield f"{start}{step}", after.get(step)


def _put(data: dict[str, Any], key: str, value: Value) -> list[ConfigFault]:
    """Set a value in plain data at a dotted key; return the faults."""
    *over, last = key.split(".")
    held: Any = data
    declared: Declaration | None = Declaration("params", params=Rig)
    for step in over:
        declared = declared.below(step) if declared is not None else None
        below = held.get(step) if isinstance(held, dict) else ()
        if below is None or (declared is not None and below in declared.choices):
            held[step] = {}
        held = held[step] if isinstance(held, dict) else None
    if not isinstance(held, dict):
        rule = f"unknown key {abbreviate(last)}; {'.'.join(over)} is a single value"
        return [ConfigFault("", None, key, abbreviate(value), rule)]
    items = declared.inner if declared is not None else None
    if value is None and items is not None and not items.optional:
        held.pop(last, None)
    else:
        held[last] = _overlay(held.get(last), value)
    return []


def _overlay(low: Any, high: Any) -> Any:
    if not (isinstance(low, dict) and isinstance(high, dict)):
        return high
    return {**low, **{key: _overlay(low.get(key), value) for key, value in high.items()}}

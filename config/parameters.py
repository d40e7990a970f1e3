"""Parameters of a rig: meaning, bounds, default, and the time at which a change takes effect.

A key is the dotted path of the YAML. Changes by keys are checked like those in a file: errors have
the same texts, and after an error nothing is changed. Pure.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from gazerig.config.load import ConfigError, shipped_path, validate_rules
from gazerig.config.rig import GazeConfig, Rig
from gazerig.config.schema import RULES, refusal
from gazerig.config.shipped_files import file_in_folders, is_path
from gazerig.params import Declaration, declarations, unknown_text
from gazerig.robot.model.commands import Value
from gazerig.robot.model.parameter import Parameter

NEXT_TICK = "next tick"
NEXT_START = "next start"

LIVE_LIMITS = ("min_deg", "max_deg", "max_speed_deg_s", "max_accel_deg_s2")
"""Keys of a joint that a running rig applies."""
_LIVE = (
    "character.",
    "ranges.",
    "guard.",
    "sound.device.",
    # A package's rule is created with its section, and so is the chooser.
    *(f"gaze.{name}." for name in declarations(GazeConfig) if name != "chooser"),
)
"""Starts of other keys that a running rig applies; it reads all others when it starts."""
_RIG = Declaration("params", params=Rig)


def parameters(rig: Rig, defaults: Rig) -> tuple[Parameter, ...]:
    """Return the parameters of a rig in the order of its file."""
    known = values(defaults)
    return tuple(
        Parameter(
            key,
            key.rpartition(".")[0],
            declared.unit,
            declared.description,
            declared.innermost.low,
            declared.innermost.high,
            declared.innermost.choices,
            "mapping" if declared.form == "params" else declared.form,
            known.get(key),
            effect_time(key),
            declared.optional,
            declared.length,
            declared.inner.form if declared.inner is not None else None,
        )
        for key, declared, _ in _leaves(rig)
    )


def value_of(rig: Any, key: str) -> Any:
    """Return the value at a dotted key of a dataclass; a mapping for a group.

    Raises:
        gazerig.config.load.ConfigError: the key does not exist; the message lists the existing
            ones.
    """
    value = to_plain(rig)
    for step in key.split("."):
        names = value if isinstance(value, dict) else {}
        if step not in names:
            raise refusal(key, unknown_text("key", step, names))
        value = names[step]
    return value


def values(rig: Rig) -> dict[str, Value]:
    """Return the values of all parameters by key."""
    return {key: to_plain(value) for key, _, value in _leaves(rig)}


def apply_changes(rig: Rig, changes: Mapping[str, Value]) -> Rig:
    """Return the rig with other values at dotted keys, after checking every rule.

    A mapping is merged over the present one, like a layer of a file. None removes an entry of a
    mapping.

    Raises:
        gazerig.config.load.ConfigError: lists every fault, as when a file is loaded.
    """
    data = to_plain(rig)
    for key, value in changes.items():
        data = merge(data, nest({key: to_plain(value)}), _RIG)
    made, found = validate_rules(Rig, data, RULES)
    if found or made is None:
        raise ConfigError(found)
    return made


def differences(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes that turn one rig into another: ``changed(before, ...) == after``.

    A removed entry of a mapping has the value None.
    """
    return dict(_differences(to_plain(before), to_plain(after), ""))


def flatten_changes(changes: Mapping[str, Any]) -> dict[str, Value]:
    """Return changes with mappings expanded to their single keys, as in a file."""
    return dict(_differences({}, changes, ""))


def nest(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return values at dotted keys as nested mappings, as in a file."""
    nested: dict[str, Any] = {}
    for key, value in changes.items():
        for step in reversed(key.split(".")):
            value = {step: value}
        nested = merge(nested, value)
    return nested


def merge(low: Any, high: Any, declared: Declaration | None = None) -> Any:
    """Return plain values merged over others.

    declared: declaration of both; its mappings contain no null, which removes an entry
    """
    if not isinstance(high, dict):
        return high
    merged = dict(low) if isinstance(low, dict) else {}
    for key, value in high.items():
        if value is None and declared and declared.form == "mapping":
            merged.pop(key, None)
        else:
            merged[key] = merge(merged.get(key), value, declared and declared.below(key))
    return merged


def to_plain(value: Any) -> Any:
    """Return frozen values as dicts, tuples and scalars."""
    if dataclasses.is_dataclass(value):
        value = _fields(value)
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    return tuple(map(to_plain, value)) if isinstance(value, list | tuple) else value


def effect_time(key: str) -> str:
    """Return when a change of a key takes effect."""
    limit = key.startswith("joints.") and key.endswith(LIVE_LIMITS)
    return NEXT_TICK if limit or f"{key}.".startswith(_LIVE) else NEXT_START


def start_note(key: str) -> str:
    """Return " (at the next start)" if a running rig does not apply a key, otherwise ""."""
    return " (at the next start)" if effect_time(key) == NEXT_START else ""


def _fields(value: Any) -> dict[str, Any]:
    own = {name: getattr(value, name) for name in declarations(value.__class__)}
    return own | getattr(value, "plugins", {})


def _leaves(
    value: Any, declared: Declaration = _RIG, key: str = ""
) -> Iterator[tuple[str, Declaration, Any]]:
    """Yield key, declaration and value of every leaf below a position."""
    if dataclasses.is_dataclass(value):
        value = _fields(value)
    elif declared.form != "mapping":
        yield key, declared, value
        return
    for step, item in value.items():
        below = declared.below(step) or Declaration("params", params=type(item))
        yield from _leaves(item, below, f"{key}.{step}" if key else step)


def _differences(before: Any, after: Any, key: str) -> Iterator[tuple[str, Value]]:
    old = before if isinstance(before, Mapping) else {}
    if isinstance(after, Mapping) and (old or after):
        for step in {**old, **after}:
            below = f"{key}.{step}" if key else step
            yield from _differences(old.get(step, ...), after.get(step), below)
    elif before != after:
        yield key, after


_KIND_OF_KEY = {
    "gaze.scanpath.transition_matrix": "scanpaths",
    "profile": "profiles",
    "character": "characters",
}
"""Keys of a rig that contain a shipped name or a file, and the kind of the names."""
_FILE_KEYS = re.compile(r"track_files|sound\.folders")
"""Other keys that contain files."""
_LOCAL_KEYS = re.compile(r"(doors|bus\.port|buses\..+\.port|sound\.voice)(\..+)?")
"""Keys that start programs or open devices of this computer."""
_LOCAL = (
    "starts a program or opens a device of the head's computer, so it cannot be set over the network: "
    "set it in the rig's file or with gazerig ctl set on that computer"
)


class AllowedFolder:
    """A folder; files in it and below it may be named."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()

    def check_file(
        self, given: str, kind: str = "", key: str = "", start: Path | None = None
    ) -> str:
        """Return a shipped name unchanged, or the full path of a file in the folder.

        Args:
            given: Name or path.
            kind: Kind of the accepted shipped names, e.g. "characters"; "" for none.
            key: Key for the message of a fault.
            start: Base of relative paths; None: the folder.

        Raises:
            gazerig.config.load.ConfigError: the file, after resolving links, is outside the folder.
        """
        if kind and not is_path(given):
            shipped_path(kind, given)
            return given
        try:
            return file_in_folders([self.folder], given, start)
        except ValueError as error:
            raise refusal(key, str(error)) from None

    def check_changes(self, changes: Mapping[str, object]) -> None:
        """Check new values of a rig's keys: the files they name, and keys that stay with its owner.

        Relative paths start at the working folder, as when the files are opened.

        Raises:
            gazerig.config.load.ConfigError: a key may not be set, or a file may not be named.
        """
        for key, value in flatten_changes(changes).items():
            if _LOCAL_KEYS.fullmatch(key):
                raise refusal(key, _LOCAL)
            if key in _KIND_OF_KEY or _FILE_KEYS.fullmatch(key):
                for file in value if isinstance(value, list | tuple) else (value,):
                    if isinstance(file, str) and file:
                        self.check_file(file, _KIND_OF_KEY.get(key, ""), key, Path.cwd())

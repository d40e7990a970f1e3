"""Parameters of a rig, changed values and saved files: one type for file, rig, page and client."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

JsonValue = float | int | bool | str | None | list["JsonValue"] | dict[str, "JsonValue"]
"""A value as it arrives over the wire: lists where the rig has tuples."""


class Parameter(NamedTuple):
    """One parameter of a rig, its rule and its default.

    key: dotted path in the YAML; group: the path above it, "" at the top
    unit: "" for a bare number; description: as declared beside the value
    low, high: bounds, None if there is none; of a list, those of its items
    choices: the allowed values, empty if any value of its kind is allowed
    kind: number, whole, bool, text, choice, list or mapping
    default: its value in the rig of defaults
    live: "next tick", or "next start: " and why a running rig cannot take it
    optional: null is allowed
    length: number of items of a list, None if it is free; items: kind of its items
    """

    key: str
    group: str
    unit: str
    description: str
    low: float | None
    high: float | None
    choices: tuple[Any, ...]
    kind: str
    default: Any
    live: str
    optional: bool = False
    length: int | None = None
    items: str | None = None

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Parameter":
        """Return a parameter from a rig's answer; keys that are not fields are ignored."""
        named = {name: data[name] for name in cls._fields if name in data}
        return cls(**{**named, "choices": tuple(named["choices"])})


class ParamChange(NamedTuple):
    """One value that differs: from the file, or from the default.

    key: dotted key; old, new: as YAML; ``old`` is None if the key is not in the file
    """

    key: str
    old: str | None
    new: str

    def __str__(self) -> str:
        """Return ``key: old -> new``."""
        return f"{self.key}: {'(not in the file)' if self.old is None else self.old} -> {self.new}"


class SavedFile(NamedTuple):
    """A file that was saved; ``backup`` is None if nothing differed or the file is new."""

    path: Path
    backup: Path | None
    changes: tuple[ParamChange, ...]

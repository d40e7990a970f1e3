"""Parameters of a rig, changed values and saved files, for file, rig, page and client."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

JsonValue = float | int | bool | str | None | list["JsonValue"] | dict[str, "JsonValue"]
"""A value in JSON, with lists instead of the rig's tuples."""


class Parameter(NamedTuple):
    """A parameter of a rig with its rules and its default.

    Attributes:
        key: Dotted path in the YAML.
        group: Path above it, "" at the top.
        unit: Unit, "" for a bare number.
        description: Description from the declaration.
        low, high: Bounds, of a list those of its items, None if there are none.
        choices: Allowed values, empty if any value of its kind is allowed.
        kind: number, whole, bool, text, choice, list or mapping.
        default: Value in the rig of defaults.
        live: "next tick", or "next start: " and the reason why a running rig cannot apply it.
        optional: Whether null is allowed.
        length: Number of items of a list, None if any.
        items: Kind of the items.
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
    """A value that differs from the file or from the default.

    Attributes:
        key: Dotted key.
        old: Old value as YAML, None if the key is not in the file.
        new: New value as YAML.
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

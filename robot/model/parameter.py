"""Parameters of a rig, changed values and saved files, for file, rig, page and client."""

from pathlib import Path
from typing import Any

from msgspec import Struct


class Parameter(Struct, frozen=True):
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
        live: "next tick", or "next start" if a running rig does not apply it.
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


class ParamChange(Struct, frozen=True):
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


class SavedFile(Struct, frozen=True):
    """A file that was saved; ``backup`` is None if nothing differed or the file is new."""

    path: Path
    backup: Path | None
    changes: tuple[ParamChange, ...]

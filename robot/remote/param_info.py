"""What a running rig tells another program of its parameters: rules, differences, saved files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, cast

JsonValue = float | int | bool | str | None | list["JsonValue"] | dict[str, "JsonValue"]
"""A value as it comes over the wire: lists where the rig has tuples."""


class ParamInfo(NamedTuple):
    """One parameter of the rig, its rule and its default.

    unit: "" for a bare number; description: what it is; low, high: None where there is no bound
    choices: empty where any value of its kind may stand
    kind: number, whole, bool, text, choice, list or mapping
    live: when a change takes effect, "next tick", or "next start" with the reason
    optional: null may stand here; length: of a list, None where it is free; items: their kind
    """

    key: str
    group: str
    unit: str
    description: str
    low: float | None
    high: float | None
    choices: tuple[Any, ...]
    kind: str
    default: JsonValue
    live: str
    optional: bool = False
    length: int | None = None
    items: str | None = None

    @classmethod
    def from_json(cls, said: Mapping[str, Any]) -> "ParamInfo":
        """Return a rig's description of one parameter; keys that are not fields are ignored."""
        named = {name: said[name] for name in cls._fields if name in said}
        named.setdefault("description", said.get("says", ""))  # the key in answers of older rigs
        return cls(**{**named, "choices": tuple(named["choices"])})


class ParamDifference(NamedTuple):
    """One value that differs: from the file (``unsaved``) or from the default (``differs``)."""

    key: str
    old: JsonValue
    new: JsonValue


class SavedFile(NamedTuple):
    """What was written; ``backup`` is None where nothing differed or the file is new."""

    path: Path
    backup: Path | None
    changes: tuple[ParamDifference, ...]


def differences(said: object) -> tuple[ParamDifference, ...]:
    """Return the differences that a rig's answer lists."""
    rows = cast(list[dict[str, Any]], said)
    return tuple(ParamDifference(row["key"], row["old"], row["new"]) for row in rows)

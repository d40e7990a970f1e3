"""The declaration of a parameter: one annotated field of a frozen dataclass, in one line.

    comfort_deg: Annotated[float, Bounds(0, 90), "comfortable eccentricity of an eye"] = 8.0
    profile: Annotated[Literal["min_jerk", "main_sequence"], "profile of saccades"] = "min_jerk"

The configuration, live tuning, the page and the documents read this line.
Every part of the program may import this module; it needs the standard library only.
"""

import dataclasses
import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import Any, Literal

UNITS: dict[str, str] = {
    "_deg_s2": "deg/s2",
    "_deg_s": "deg/s",
    "_rad_s": "rad/s",
    "_m_s2": "m/s2",
    "_m_s": "m/s",
    "_1_s": "1/s",
    "_1_m": "1/m",
    "_1_deg": "1/deg",
    "_per_deg": "1/deg",
    "_per_min": "1/min",
    "_per_deg_ms": "ms/deg",
    "_percent": "%",
    "_nm_deg": "Nm/deg",
    "_deg": "deg",
    "_nm": "Nm",
    "_kg_m3": "kg/m3",
    "_kg": "kg",
    "_mm": "mm",
    "_m": "m",
    "_px": "px",
    "_hz": "Hz",
    "_ms": "ms",
    "_us": "us",
    "_s": "s",
    "_c": "degC",
    "_v": "V",
    "baud": "bit/s",
}
"""Suffix of a parameter's name -> its unit."""
_LONGEST_FIRST = sorted(UNITS, key=len, reverse=True)


@dataclasses.dataclass(frozen=True, slots=True)
class Bounds:
    """Inclusive bounds of a number, or of every number in a tuple or mapping."""

    low: float
    high: float


@dataclasses.dataclass(frozen=True, slots=True, init=False)
class Choices:
    """Allowed values, or allowed values of every item, if a Literal cannot list them."""

    values: tuple[object, ...]

    def __init__(self, *values: object) -> None:
        object.__setattr__(self, "values", values)


@dataclasses.dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a parameter whose name does not end with it."""

    name: str


@dataclasses.dataclass(frozen=True, slots=True)
class Declaration:
    """One parameter as declared.

    kind: type annotation without its metadata
    bounds: bounds of the number, or of the numbers in it; None without bounds
    choices: the allowed values, () if all are allowed
    unit: e.g. "deg/s", "" for a bare number
    """

    name: str
    kind: Any
    bounds: Bounds | None
    choices: tuple[object, ...]
    unit: str
    description: str


@cache
def declarations(params: type) -> dict[str, Declaration]:
    """Return the declaration of every field of a Params dataclass, by name, in order.

    Raises:
        TypeError: the metadata of a field is of an unknown kind.
    """
    hints = typing.get_type_hints(params, include_extras=True)
    return {
        f.name: _declaration(f"{params.__qualname__}.{f.name}", f.name, hints[f.name])
        for f in dataclasses.fields(params)
        if f.init
    }


def choices_of(params: type, name: str) -> tuple[Any, ...]:
    """Return the allowed values of a parameter, () without a list."""
    return declarations(params)[name].choices


def unit_of(name: str) -> str:
    """Return the unit with which a parameter's name ends, "" without one."""
    return next((UNITS[suffix] for suffix in _LONGEST_FIRST if name.endswith(suffix)), "")


def _declaration(place: str, name: str, hint: Any) -> Declaration:
    noted = typing.get_origin(hint) is typing.Annotated
    kind, *notes = typing.get_args(hint) if noted else (hint,)
    found: dict[type, Any] = {type(note): note for note in notes}
    if strange := found.keys() - {str, Bounds, Choices, Unit}:
        names = ", ".join(sorted(one.__name__ for one in strange))
        raise TypeError(f"{place}: {names}: expected Bounds, Choices, Unit or a description")
    if len(found) < len(notes):
        raise TypeError(f"{place}: two metadata entries of the same kind")
    nested = dataclasses.is_dataclass(_innermost(kind))
    return Declaration(
        name,
        kind,
        found.get(Bounds),
        found[Choices].values if Choices in found else _literals(kind),
        found[Unit].name if Unit in found else "" if nested else unit_of(name),
        found.get(str, ""),
    )


def _literals(kind: Any) -> tuple[object, ...]:
    """Return the values of a Literal, alone or as an item of a tuple or a mapping."""
    innermost = _innermost(kind)
    return typing.get_args(innermost) if typing.get_origin(innermost) is Literal else ()


def _innermost(kind: Any) -> Any:
    """Return the innermost type of optionals, tuples and mappings."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType, tuple):
        return _innermost(args[0])
    return _innermost(args[1]) if origin in (dict, Mapping) else kind

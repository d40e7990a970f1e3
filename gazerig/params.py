"""The declaration of a parameter: one annotated field of a frozen dataclass, in one line.

    comfort_deg: Annotated[float, Bounds(0, 90), "comfortable eccentricity of an eye"] = 8.0
    profile: Annotated[Literal["min_jerk", "human"], "profile of saccades"] = "min_jerk"

The configuration, live tuning, the page and the documents read this line; pydantic validates the
dataclass itself. Every part of the program may import this module; it needs the standard library
only.
"""

import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from difflib import get_close_matches
from functools import cache
from typing import Any, Literal

UNITS: dict[str, str] = {
    "_deg_s2": "deg/s2",
    "_deg_s": "deg/s",
    "_m_s": "m/s",
    "_1_s": "1/s",
    "_1_m": "1/m",
    "_per_min": "1/min",
    "_percent": "%",
    "_deg": "deg",
    "_kg": "kg",
    "_mm": "mm",
    "_m": "m",
    "_px": "px",
    "_hz": "Hz",
    "_ms": "ms",
    "_s": "s",
    "baud": "bit/s",
}
"""Suffix of a parameter's name -> its unit."""
_LONGEST_FIRST = sorted(UNITS, key=len, reverse=True)


@dataclass(frozen=True, slots=True)
class Bounds:
    """Inclusive bounds of a number, or of every number in a tuple or mapping."""

    low: float
    high: float

    def __get_pydantic_core_schema__(self, kind: Any, handler: Any) -> Any:
        """Return the schema of the type with these bounds."""
        schema = handler(kind)
        for number in _numbers(schema):
            bound = int if number["type"] == "int" else float
            number |= {"ge": bound(self.low), "le": bound(self.high)}
        return schema


@dataclass(frozen=True, slots=True, init=False)
class Choices:
    """Allowed values, if a Literal cannot list them."""

    values: tuple[object, ...]

    def __init__(self, *values: object) -> None:
        object.__setattr__(self, "values", values)

    def __get_pydantic_core_schema__(self, kind: Any, handler: Any) -> Any:
        """Return the schema of these values."""
        return {"type": "literal", "expected": list(self.values)}


@dataclass(frozen=True)
class Unit:
    """Unit of a parameter whose name does not end with it."""

    name: str


@dataclass(frozen=True)
class Unlisted:
    """Marks a mapping that no file contains."""

    def __get_pydantic_core_schema__(self, kind: Any, handler: Any) -> Any:
        """Return the schema of an empty mapping, which is the field's default."""
        return {"type": "dict", "max_length": 0}


Form = Literal[
    "number", "whole", "bool", "text", "choice", "list", "row", "mapping", "params", "value"
]
_PLAIN: dict[object, Form] = {float: "number", int: "whole", bool: "bool", str: "text"}


@dataclass(frozen=True)
class Declaration:
    """A parameter as declared, or an item of one.

    inner: items of a list or mapping
    items: items of a row, a list of different values
    params: the dataclass, for form "params"
    optional: null is allowed
    low, high: bounds of a number, None without bounds
    choices: the allowed values of form "choice"; beside form "params", those allowed in its place
    length: number of items of a list, None for any
    unit: e.g. "deg/s", "" for a bare number
    """

    form: Form
    inner: "Declaration | None" = None
    items: "tuple[Declaration, ...]" = ()
    params: type | None = None
    optional: bool = False
    choices: tuple[Any, ...] = ()
    low: float | None = None
    high: float | None = None
    length: int | None = None
    unit: str = ""
    description: str = ""

    @property
    def innermost(self) -> "Declaration":
        """Return the items of nested lists and mappings, or itself."""
        return self if self.inner is None else self.inner.innermost

    def below(self, step: str | int) -> "Declaration | None":
        """Return the declaration one step of a path below, None if no such key exists."""
        if self.items and isinstance(step, int):
            return self.items[step]
        return declarations(self.params).get(str(step)) if self.params else self.inner


@cache
def declarations(params: type) -> dict[str, Declaration]:
    """Return the declaration of every field of a Params dataclass, by name, in order."""
    hints = typing.get_type_hints(params, include_extras=True)
    own = {f.name: hints[f.name] for f in fields(params) if f.init}
    return {
        name: _declaration(hint, Declaration("value", unit=unit_of(name)))
        for name, hint in own.items()
        if Unlisted() not in typing.get_args(hint)
    }


def unit_of(name: str) -> str:
    """Return the unit with which a parameter's name ends, "" without one."""
    return next((UNITS[suffix] for suffix in _LONGEST_FIRST if name.endswith(suffix)), "")


def _declaration(hint: Any, above: Declaration) -> Declaration:
    """Read a type annotation; unit, description and bounds are those above unless it has its own.

    Raises:
        TypeError: a configuration value cannot have this type.
    """
    origin, args = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Annotated:
        for note in args[1:]:
            match note:
                case Bounds():
                    above = replace(above, low=note.low, high=note.high)
                case Choices():
                    above = replace(above, choices=note.values)
                case Unit():
                    above = replace(above, unit=note.name)
                case str():
                    above = replace(above, description=note)
        return _declaration(args[0], above)
    if origin in (typing.Union, types.UnionType):
        optional = type(None) in args
        first, *others = [kind for kind in args if kind is not type(None)]
        made = _declaration(first, above)
        literals = tuple(value for kind in others for value in typing.get_args(kind))
        return replace(made, optional=optional, choices=(*made.choices, *literals))
    plain = replace(above, low=None, high=None, choices=())
    if isinstance(hint, type) and is_dataclass(hint):
        return replace(plain, form="params", params=hint, unit="")
    if origin is tuple:
        length = None if args[-1] is ... else len(args)
        if length is not None and len(set(args)) > 1:
            items = tuple([_declaration(kind, above) for kind in args])
            return replace(plain, form="row", items=items, length=length)
        inner = _declaration(args[0], above)
        return replace(plain, form="list", inner=inner, length=length)
    if origin in (dict, Mapping):
        return replace(plain, form="mapping", inner=_declaration(args[1], above))
    if origin is Literal or above.choices:
        return replace(plain, form="choice", choices=above.choices or args)
    if hint in (float, int):
        return replace(above, form=_PLAIN[hint])
    if hint is object or hint in _PLAIN:
        return replace(plain, form=_PLAIN.get(hint, "value"))
    raise TypeError(f"a configuration value cannot have the type {hint}")


def _numbers(schema: Any) -> Iterator[Any]:
    """Yield the schemas of numbers in pydantic's schema of optionals, tuples and mappings."""
    match schema:
        case {"type": "float" | "int"}:
            yield schema
        case {"type": "tuple", "items_schema": [*items]}:
            for item in items:
                yield from _numbers(item)
        case {"schema": inner} | {"values_schema": inner}:
            yield from _numbers(inner)


def suggestion_text(word: str, words: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" if a known word is similar, otherwise ""."""
    near = get_close_matches(word, list(words), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def unknown_text(kind: str, name: str, names: Iterable[str], without: str = "none") -> str:
    """Return that nothing of a kind has a name, with a similar name and all names.

    Args:
        kind: Kind of the named things.
        name: The unknown name.
        names: Known names.
        without: Remedy if there are no names.
    """
    known = list(names)
    near = suggestion_text(name.lower(), known) or ";"
    return f"no {kind} {name!r}{near} available: {', '.join(known) or without}"

"""Validation of plain values into Params dataclasses by pydantic, and its errors as text.

``__post_init__`` may raise ValueError if two fields contradict each other.
"""

import dataclasses
import difflib
import json
import reprlib
from collections.abc import Container, Iterable
from fnmatch import fnmatchcase
from functools import cache
from types import GenericAlias
from typing import Any, NamedTuple, TypeVar, cast

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from gazerig.config.shipped_files import SHIPPED
from gazerig.params import Declaration, declarations

T = TypeVar("T")
Step = str | int
Path = tuple[Step, ...]

_TYPE_WORDS: dict[type, str] = {
    bool: "a truth value",
    int: "a whole number",
    float: "a number",
    str: "text",
    dict: "a mapping",
    list: "a list",
}


class Violation(NamedTuple):
    """One error in plain values: path, value and the broken rule as text.

    meant: path of the key of which an unknown key is a misspelling, () if unknown
    """

    path: Path
    value: str
    rule: str
    meant: Path = ()


def validate(into: type[T], data: object) -> tuple[T | None, list[Violation]]:
    """Return the frozen dataclass for plain values, or None with every error.

    ``data`` consists of dicts, tuples, str, int, float, bool and None.
    """
    try:
        # Only values from JSON become dataclasses and tuples in pydantic's strict mode.
        value = _adapter(cast(Any, into)).validate_json(json.dumps([data], default=repr))
    except ValidationError as error:
        details = error.errors(include_url=False)
        return None, list(dict.fromkeys(v for one in details for v in _violations(into, one)))
    return cast(T, value[0]), []


@cache
def _adapter(params: type) -> TypeAdapter[Any]:
    """Return the validator of a dataclass; pydantic accepts a configuration only around it."""
    config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, validate_default=True)
    whole: Any = GenericAlias(tuple, (params,))
    return TypeAdapter(whole, config=config)


class _Unknown:
    """Stands for a faulty value; a rule that reads it ends with an AttributeError or TypeError."""

    def _end(self, *_: object) -> Any:
        raise AttributeError

    __bool__ = __eq__ = __hash__ = __str__ = _end


_UNKNOWN: Any = _Unknown()


def fill(declared: Declaration, data: Any, faulty: Container[Path], path: Path = ()) -> Any:
    """Return a value of which some parts are faulty; these end the rule that reads them."""
    if path in faulty:
        return _UNKNOWN
    match declared, data:
        case Declaration(params=type() as params), dict():
            made: Any = object.__new__(params)
            shown = declarations(params)
            for field in dataclasses.fields(params):
                name, below = field.name, (*path, field.name)
                given = name in shown and (name in data or below in faulty)
                value = (
                    fill(shown[name], data.get(name), faulty, below) if given else _default(field)
                )
                object.__setattr__(made, name, value)
            return made
        case Declaration(inner=Declaration() as inner), dict():
            return {key: fill(inner, one, faulty, (*path, key)) for key, one in data.items()}
        case Declaration(form="row"), tuple():
            pairs = enumerate(zip(declared.items, data, strict=False))
            return tuple(fill(one, item, faulty, (*path, i)) for i, (one, item) in pairs)
        case Declaration(inner=Declaration() as inner), tuple():
            return tuple(fill(inner, one, faulty, (*path, i)) for i, one in enumerate(data))
    return float(data) if declared.form == "number" and data is not None else data


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return _UNKNOWN if field.default is dataclasses.MISSING else field.default


def expected_text(declared: Declaration) -> str:
    """Return the allowed values of a position, as text."""
    choices = ", ".join(map(repr, declared.choices))
    match declared:
        case Declaration(form="number"):
            text = f"a number{_range(declared)}"
        case Declaration(form="whole"):
            text = f"a whole number{_range(declared)}"
        case Declaration(form="bool"):
            text = "true or false"
        case Declaration(form="value"):
            text = "a value"
        case Declaration(form="choice"):
            text = f"one of {choices}"
        case Declaration(form="list", inner=Declaration() as inner):
            count = f" of {declared.length}" if declared.length is not None else ""
            text = f"a list{count}, each {expected_text(inner)}"
        case Declaration(form="row"):
            text = f"a list of {', '.join(map(expected_text, declared.items))}"
        case Declaration(form="mapping", inner=Declaration() as inner):
            text = f"a mapping, each key with {expected_text(inner)}"
        case Declaration(params=type() as params):
            text = f"a mapping with the keys {', '.join(declarations(params))}"
            text = f"{choices} or {text}" if choices else text
        case _:
            text = "text"
    return f"{text} or null" if declared.optional else text


def suggestion_text(word: str, words: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" if a known word is similar, otherwise ""."""
    near = difflib.get_close_matches(word, list(words), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def abbreviate(value: object) -> str:
    """Return a value for a message, cut if it is long."""
    writer = reprlib.Repr()
    writer.maxlevel, writer.maxstring, writer.maxother = 2, 60, 60
    writer.maxdict = writer.maxtuple = writer.maxlist = 6
    return writer.repr(value)


def _violations(into: type, details: ErrorDetails) -> list[Violation]:
    """Return one pydantic error as violations: several if a section has several removed keys."""
    holder = declared = Declaration("params", params=into)
    path: list[Step] = []
    value = details["input"]
    for step in details["loc"][1:]:
        below = declared.below(step)
        if below is not None:
            holder, declared = declared, below
            path.append(step)
        elif not (declared.choices and _names_alternative(declared, step)):
            return _unknown_key(declared, (*path, step), value)
    if removed := _removed_keys(tuple(path), value):
        return removed
    alternatives = bool(declared.params and declared.choices)
    if alternatives and isinstance(value, dict) == (details["type"] == "literal_error"):
        return []  # the error of the other alternative
    if details["type"] == "missing" and isinstance(details["loc"][-1], int):
        rule = f"has length {len(value)}, wanted {holder.length}"
        return [Violation(tuple(path[:-1]), abbreviate(value), rule)]
    if details["type"] == "missing":
        described = f" ({declared.description})" if declared.description else ""
        return [Violation(tuple(path), "", f"missing; wanted {expected_text(declared)}{described}")]
    return [Violation(tuple(path), abbreviate(value), _rule(declared, details))]


def _names_alternative(declared: Declaration, step: Step) -> bool:
    """Return whether pydantic names one of two alternatives by a step, which is no key."""
    if declared.params is None or not declared.choices:
        return False
    return str(step).startswith(("literal[", declared.params.__name__))


def _unknown_key(holder: Declaration, path: Path, value: Any) -> list[Violation]:
    """Return the violation of a key that does not exist, or does not exist any more."""
    if removed := _removed_keys(path, value):
        return removed
    name, names = str(path[-1]), tuple(declarations(holder.params)) if holder.params else ()
    near = difflib.get_close_matches(name, names, 1)
    hint = suggestion_text(name, names) or ";"
    rule = f"unknown key {abbreviate(name)}{hint} allowed: {', '.join(names) or 'none'}"
    meant = (*path[:-1], near[0]) if near else ()
    return [Violation(path, abbreviate(value), rule, meant)]


@cache
def _removed_table() -> dict[str, str]:
    lines = (SHIPPED / "removed_keys.yaml").read_text(encoding="utf-8").splitlines()
    pairs = [line.split(": ", 1) for line in lines if not line.startswith("#")]
    return {key: remedy.strip("'\"") for key, remedy in pairs}


def _removed_keys(path: Path, value: Any) -> list[Violation]:
    """Return the violations of a key that former versions had, and of such keys below it."""
    key = ".".join(map(str, path))
    for pattern, remedy in _removed_table().items():
        if fnmatchcase(key, pattern):
            return [Violation(path, abbreviate(value), f"is gone: {remedy}")]
    below = value.items() if isinstance(value, dict) else ()
    return [found for step, one in below for found in _removed_keys((*path, step), one)]


def _number(value: float) -> str:
    """Return a bound in plain notation: 2000, not 2000.0 or 2e+03."""
    return format(value, ".12g")


def _rule(declared: Declaration, details: ErrorDetails) -> str:
    """Return the rule that a value breaks, as text."""
    value, unit = details["input"], f" (unit {declared.unit})" if declared.unit else ""
    match details["type"]:
        case "greater_than_equal" if declared.low is not None:
            return f"{abbreviate(value)} is below {_number(declared.low)}{unit}"
        case "less_than_equal" if declared.high is not None:
            return f"{abbreviate(value)} is above {_number(declared.high)}{unit}"
        case "finite_number":
            return f"{abbreviate(value)} is not a finite number"
        case "too_long":
            return f"has length {len(value)}, wanted {declared.length}"
        case "value_error":
            return " ".join(str(details["ctx"]["error"]).split())
        case "literal_error" if isinstance(value, str):
            hint = suggestion_text(value, map(str, declared.choices))
            return f"{abbreviate(value)} is not {expected_text(declared)}{hint}"
    if value is None:
        named = "is empty"
    elif isinstance(value, dict | list):
        named = f"is {_TYPE_WORDS[type(value)]}"
    else:
        named = f"{abbreviate(value)} is {_TYPE_WORDS.get(type(value), type(value).__name__)}"
    hint = ""  # the correction, if it is obvious
    if declared.form == "text" and isinstance(value, bool | int | float):
        hint = "; put it in quotes"
    elif declared.form in ("number", "whole") and isinstance(value, str):
        bare = value.replace(".", "", 1).removeprefix("-").isdecimal()
        hint = "; remove the quotes" if bare else ""
    return f"{named}, wanted {expected_text(declared)}{hint}"


def _range(declared: Declaration) -> str:
    """Return the bounds and the unit, as text."""
    unit = f" {declared.unit}" if declared.unit else ""
    if declared.low is not None and declared.high is not None:
        return f", {_number(declared.low)} to {_number(declared.high)}{unit}"
    return f" in{unit}" if unit else ""

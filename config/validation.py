"""Validation of plain values into Params dataclasses by pydantic, and its errors as text.

``__post_init__`` may raise ValueError if two fields contradict each other.
"""

import dataclasses
import json
import reprlib
from collections.abc import Container, Iterator
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cache
from types import GenericAlias
from typing import Any, TypeVar, cast

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from gazerig.config.faults import ConfigFault
from gazerig.config.shipped_files import SHIPPED
from gazerig.params import Declaration, declarations, suggestion_text

T = TypeVar("T")
Step = str | int
Path = tuple[Step, ...]

_WORDS = {
    "number": "a number",
    "whole": "a whole number",
    "bool": "true or false",
    "text": "text",
    "value": "a value",
    "list": "a list",
    "row": "a list",
    "mapping": "a mapping",
    "params": "a mapping",
}
_MOST_ERRORS = 200  # of one value; more would take minutes to describe


def validate(into: type[T], data: object, above: Path = ()) -> tuple[T | None, list[ConfigFault]]:
    """Return the frozen dataclass for plain values, or None with every fault, without its file.

    data: dicts, tuples, str, int, float, bool and None
    above: path of the data
    """
    try:
        # Only values from JSON become dataclasses and tuples in pydantic's strict mode.
        value = _adapter(cast(Any, into)).validate_json(json.dumps([data], default=repr))
    except ValidationError as error:
        details = error.errors(include_url=False)[:_MOST_ERRORS]
        return None, list(dict.fromkeys(f for one in details for f in _faults(into, above, one)))
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


def fill(declared: Declaration, data: Any, faulty: Container[str], key: str = "") -> Any:
    """Return a value of which some parts are faulty; these end the rule that reads them."""
    if key in faulty:
        return _UNKNOWN
    start = f"{key}." if key else ""
    if declared.params is not None and isinstance(data, dict):
        known: dict[str, Any] = declarations(declared.params)
        meant = {near for name in data.keys() - known for near in get_close_matches(name, known, 1)}
        made: Any = object.__new__(declared.params)
        for field in dataclasses.fields(declared.params):
            name, value = field.name, _UNKNOWN
            if name in data:
                value = fill(known[name], data[name], faulty, start + name)
            elif start + name not in faulty and name not in meant:
                create: Any = field.default_factory
                value = field.default if create is dataclasses.MISSING else create()
            object.__setattr__(made, name, value)
        return made
    below = declared.inner or declared
    if isinstance(data, dict):
        return {step: fill(below, one, faulty, f"{start}{step}") for step, one in data.items()}
    if isinstance(data, tuple):
        return tuple(fill(below, one, faulty, f"{start}{i}") for i, one in enumerate(data))
    return data


def fault_at(path: Path, rule: str) -> ConfigFault:
    """Return a fault of a value, without its file."""
    return ConfigFault("", None, ".".join(map(str, path)), rule)


def expected_text(declared: Declaration) -> str:
    """Return the allowed values of a position, as text."""
    text = _WORDS.get(declared.form, "")
    if declared.low is not None:
        text += f", {declared.low:.12g} to {declared.high:.12g} {declared.unit}".rstrip()
    elif declared.unit and declared.form in ("number", "whole"):
        text += f" in {declared.unit}"
    if declared.length is not None:
        text += f" of {declared.length}"
    if declared.inner is not None:
        text += f", each {expected_text(declared.inner)}"
    if declared.items:
        text += f": {', '.join(map(expected_text, declared.items))}"
    if declared.params is not None:
        text += f" with the keys {', '.join(declarations(declared.params))}"
    words = (*map(repr, declared.choices), text, "null" if declared.optional else "")
    return " or ".join(filter(None, words))


def _faults(into: type, path: Path, details: ErrorDetails) -> list[ConfigFault]:
    """Return one pydantic error as faults: several if a section has several removed keys."""
    holder = declared = Declaration("params", params=into)
    value, kind, last = details["input"], details["type"], details["loc"][-1]
    for step in details["loc"][1:]:
        # pydantic names the alternatives of a union as well, which are no keys.
        if (below := declared.below(step)) is not None:
            path, holder, declared = (*path, step), declared, below
    if kind == "missing" and isinstance(last, int):  # of a list
        path, declared, kind = path[:-1], holder, "too_short"
    if kind == "missing":
        described = f" ({declared.description})" if declared.description else ""
        return [fault_at(path, f"missing; wanted {expected_text(declared)}{described}")]
    if kind == "literal_error" and declared.params is not None and isinstance(value, dict):
        return []  # the error of the other alternative is reported
    if kind == "unexpected_keyword_argument":
        assert declared.params is not None
        path, names = (*path, last), declarations(declared.params)
        hint = suggestion_text(str(last), names) or ";"
        rule = f"unknown key{hint} allowed: {', '.join(names) or 'none'}"
    elif kind == "value_error":
        rule = " ".join(str(details["ctx"]["error"]).split())
    else:
        found = "empty" if value is None else reprlib.repr(value)
        hint = suggestion_text(value, map(str, declared.choices)) if isinstance(value, str) else ""
        rule = f"is {found}, wanted {expected_text(declared)}{hint}"
    return list(_removed_keys(path, value)) or [fault_at(path, rule)]


@cache
def _removed_table() -> dict[str, str]:
    lines = (SHIPPED / "removed_keys.yaml").read_text(encoding="utf-8").splitlines()
    pairs = [line.split(": ", 1) for line in lines if not line.startswith("#")]
    return {key: remedy.strip("'\"") for key, remedy in pairs}


def _removed_keys(path: Path, value: Any) -> Iterator[ConfigFault]:
    """Find a key that former versions had, and such keys below it."""
    key = ".".join(map(str, path))
    for pattern, remedy in _removed_table().items():
        if fnmatchcase(key, pattern):
            yield fault_at(path, f"is gone: {remedy}")
            return
    for step, one in value.items() if isinstance(value, dict) else ():
        yield from _removed_keys((*path, step), one)

"""Validation of plain values into Params dataclasses by pydantic, and its errors as text.

``__post_init__`` may raise ValueError if two fields contradict each other.
"""

import json
import re
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cache
from types import GenericAlias
from typing import Any, TypeVar, cast

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from gazerig.config.faults import ConfigFault
from gazerig.config.shipped_files import SHIPPED
from gazerig.params import Declaration, declarations

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
_LONGEST_TEXT = 400  # characters; names and paths
_MOST_ERRORS = 200  # of one value; more would take minutes to describe
_UNSHOWN = re.compile("[\0-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters, line ends, changes of direction, and surrogates."""


def validate(into: type[T], data: object, above: Path = ()) -> tuple[T | None, list[ConfigFault]]:
    """Return the frozen dataclass for plain values, or None with every fault, without its file.

    data: dicts, tuples, str, int, float, bool and None
    above: path of the data
    """
    if strange := list(_strange_texts(data, above)):
        return None, strange
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


def fault_at(path: Path, rule: str) -> ConfigFault:
    """Return a fault of a value, without its file."""
    return ConfigFault("", None, ".".join(map(str, path)), "", rule)


def _strange_texts(value: Any, path: Path) -> Iterator[ConfigFault]:
    """Find texts that cannot be displayed, written to a file or distinguished from others."""
    for text in (value, *path[-1:]):
        if isinstance(text, str) and len(text) > _LONGEST_TEXT:
            yield fault_at(path, f"is longer than {_LONGEST_TEXT} characters; shorten it")
        elif isinstance(text, str) and (found := _UNSHOWN.search(text)):
            rule = f"contains U+{ord(found[0]):04X}, which cannot be shown; remove it"
            yield fault_at(path, rule)
    if isinstance(value, dict | tuple):
        for step, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _strange_texts(inner, (*path, step))


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


def suggestion_text(word: str, words: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" if a known word is similar, otherwise ""."""
    near = get_close_matches(word, list(words), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def abbreviate(value: object) -> str:
    """Return a value for a message, cut if it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."


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
        found = "empty" if value is None else abbreviate(value)
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

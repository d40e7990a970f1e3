"""Errors of a Params dataclass as text."""

import difflib
import reprlib
from collections.abc import Iterable
from typing import NamedTuple

from pydantic_core import ErrorDetails

from gazerig.config.bounds import Shape, Step, shapes_of

_TYPE_WORDS: dict[type, str] = {
    bool: "a truth value",
    int: "a whole number",
    float: "a number",
    str: "text",
    dict: "a mapping",
    tuple: "a list",
}


class Violation(NamedTuple):
    """One error in plain values: path, value and the broken rule as text."""

    path: tuple[Step, ...]
    value: str
    rule: str


def violation(into: type, details: ErrorDetails) -> Violation:
    """Return one pydantic error as a violation."""
    root = Shape("params", params=into)
    path = details["loc"]
    if path[-1:] == ("[key]",):  # the error is in a mapping's key, not in its value
        return Violation(path[:-1], "", _rule(Shape("text"), details))
    if details["type"] == "extra_forbidden":
        holder = _nested_shape(root, path[:-1])
        names = tuple(shapes_of(holder.params)) if holder.params else ()
        near = suggestion_text(str(path[-1]), names) or ";"
        return Violation(
            path,
            abbreviate(details["input"]),
            f"unknown key {abbreviate(path[-1])}{near} allowed: {', '.join(names) or 'none'}",
        )
    shape = _nested_shape(root, path)
    if details["type"] == "missing":
        described = f" ({shape.description})" if shape.description else ""
        return Violation(path, "", f"missing; wanted {expected_text(shape)}{described}")
    return Violation(path, abbreviate(details["input"]), _rule(shape, details))


def expected_text(shape: Shape) -> str:
    """Return the allowed values of a position, as text."""
    match shape:
        case Shape(form="number"):
            text = f"a number{_range(shape)}"
        case Shape(form="whole"):
            text = f"a whole number{_range(shape)}"
        case Shape(form="bool"):
            text = "true or false"
        case Shape(form="value"):
            text = "a value"
        case Shape(form="choice"):
            text = f"one of {', '.join(map(repr, shape.choices))}"
        case Shape(form="list", inner=Shape() as inner):
            count = f" of {shape.length}" if shape.length is not None else ""
            text = f"a list{count}, each {expected_text(inner)}"
        case Shape(form="row"):
            text = f"a list of {', '.join(map(expected_text, shape.items))}"
        case Shape(form="mapping", inner=Shape() as inner):
            text = f"a mapping, each key with {expected_text(inner)}"
        case Shape(params=type() as params):
            text = f"a mapping with the keys {', '.join(shapes_of(params))}"
        case _:
            text = "text"
    return f"{text} or null" if shape.optional else text


def suggestion_text(word: str, words: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" if a known word is similar, otherwise ""."""
    near = difflib.get_close_matches(word, list(words), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def abbreviate(value: object) -> str:
    """Return a value for a message, cut if it is long."""
    writer = reprlib.Repr()
    writer.maxlevel, writer.maxstring, writer.maxother = 2, 60, 60
    writer.maxdict = writer.maxtuple = 6
    return writer.repr(value)


def _number(value: float) -> str:
    """Return a bound in plain notation: 2000, not 2000.0 or 2e+03."""
    return format(value, ".12g")


def _rule(shape: Shape, details: ErrorDetails) -> str:
    """Return the rule that a value breaks, as text."""
    value, unit = details["input"], f" (unit {shape.unit})" if shape.unit else ""
    match details["type"]:
        case "greater_than_equal" if shape.low is not None:
            return f"{abbreviate(value)} is below {_number(shape.low)}{unit}"
        case "less_than_equal" if shape.high is not None:
            return f"{abbreviate(value)} is above {_number(shape.high)}{unit}"
        case "finite_number":
            return f"{abbreviate(value)} is not a finite number"
        case "too_short" | "too_long":
            return f"has length {len(value)}, wanted {shape.length}"
        case "value_error":
            return " ".join(str(details["ctx"]["error"]).split())
        case "literal_error" if isinstance(value, str):
            return f"{abbreviate(value)} is not {expected_text(shape)}{suggestion_text(value, map(str, shape.choices))}"
    if value is None:
        named = "is empty"
    elif isinstance(value, dict | tuple):
        named = f"is {_TYPE_WORDS[type(value)]}"
    else:
        named = f"{abbreviate(value)} is {_TYPE_WORDS.get(type(value), type(value).__name__)}"
    hint = ""  # the correction, if it is obvious
    if shape.form == "text" and isinstance(value, bool | int | float):
        hint = "; put it in quotes"
    elif shape.form in ("number", "whole") and isinstance(value, str):
        bare = value.replace(".", "", 1).removeprefix("-").isdecimal()
        hint = "; remove the quotes" if bare else ""
    return f"{named}, wanted {expected_text(shape)}{hint}"


def _range(shape: Shape) -> str:
    """Return the bounds and the unit, as text."""
    unit = f" {shape.unit}" if shape.unit else ""
    if shape.low is not None and shape.high is not None:
        return f", {_number(shape.low)} to {_number(shape.high)}{unit}"
    return f" in{unit}" if unit else ""


def _nested_shape(shape: Shape, path: tuple[Step, ...]) -> Shape:
    """Return the shape at a path through nested shapes."""
    for step in path:
        if shape.params is not None:
            shape = shapes_of(shape.params)[str(step)]
        elif shape.items:
            shape = shape.items[int(step)]
        elif shape.inner is not None:
            shape = shape.inner
    return shape

"""Strict pydantic models of Params dataclasses (gazerig.params).

``__post_init__`` may raise ValueError if two fields contradict each other.
"""

import dataclasses
import types
import typing
import unicodedata
from collections.abc import Callable, Container, Iterable, Mapping
from functools import cache, partial
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    WrapValidator,
    create_model,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from gazerig.params import Bounds, Declaration, declarations

T = TypeVar("T")
Step = str | int
Form = Literal[
    "number", "whole", "bool", "text", "choice", "list", "row", "mapping", "params", "value"
]

_PLAIN: dict[object, Form] = {
    **{float: "number", int: "whole", bool: "bool", str: "text"},
    object: "value",  # a key of another file, which has its own rules
}
_LONGEST_TEXT = 400  # characters; names and paths
_TURNS = (
    "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"  # directional formatting characters
)


@dataclasses.dataclass(frozen=True, slots=True)
class Shape:
    """The allowed values at one position in a file.

    inner: shape of the items of a list or mapping
    items: shape of each item of a row, which is a list of different values
    params: the dataclass, for form "params"
    optional: null is allowed
    low, high, choices, unit, description: values of the declaration
    length: number of items of a list, None for any
    """

    form: Form
    inner: "Shape | None" = None
    items: "tuple[Shape, ...]" = ()
    params: type | None = None
    optional: bool = False
    choices: tuple[object, ...] = ()
    low: float | None = None
    high: float | None = None
    length: int | None = None
    unit: str = ""
    description: str = ""


def validate(into: type[T], data: object) -> tuple[T | None, list[ErrorDetails]]:
    """Return the frozen dataclass for plain values, or None with every error.

    ``data`` consists of dicts, tuples, str, int, float, bool and None.
    """
    try:
        return typing.cast(T, _adapter(typing.cast(Any, into)).validate_python(data)), []
    except ValidationError as error:
        return None, [one for one in error.errors(include_url=False) if not _is_miscount(one)]


def fill_stand_ins(
    into: type[T], data: object, faulty: Container[tuple[Step, ...]], high: bool, misspelt: bool
) -> T:
    """Return the dataclass with placeholder values at faulty paths, without checking its rules.

    A placeholder is the lowest or the highest allowed value. With ``misspelt``, a key that is
    absent beside an unknown one has one too, otherwise its default. Lists and mappings have none:
    reading such a field raises AttributeError.
    """
    return typing.cast(T, _fill(Shape("params", params=into), data, (), faulty, high, misspelt))


@cache
def model_of(params: type) -> type[BaseModel]:
    """Return the strict pydantic model of a Params dataclass.

    Raises:
        TypeError: the declaration of a field is not supported.
    """
    declared = {f.name: f for f in dataclasses.fields(params) if f.init}
    columns: dict[str, Any] = {}
    for name, shape in shapes_of(params).items():
        described = shape.description  # includes the unit, for an editor's hover text
        if shape.unit:
            described = f"{described} [{shape.unit}]".strip()
        column: dict[str, Any] = {"description": described or None}
        if declared[name].default is not dataclasses.MISSING:
            column["default"] = declared[name].default
        elif declared[name].default_factory is not dataclasses.MISSING:
            column["default_factory"] = declared[name].default_factory
        columns[name] = (_annotation(shape), Field(**column))
    doc = (params.__doc__ or "").strip()
    model: type[BaseModel] = create_model(
        params.__name__,
        __config__=ConfigDict(
            strict=True,
            defer_build=True,  # nested models are built once, together with the whole model
            extra="forbid",
            validate_default=True,
            field_title_generator=lambda name, _: name,
        ),
        __module__=params.__module__,
        # The docstring of a dataclass without one is its signature.
        __doc__="" if doc.startswith(f"{params.__name__}(") else doc.partition("\n")[0],
        **columns,
    )
    return model


@cache
def shapes_of(params: type) -> dict[str, Shape]:
    """Return the shape of every field of a Params dataclass, in declaration order.

    Raises:
        TypeError: the declaration of a field is not supported.
    """
    return {
        name: _shape(declared, declared.kind, f"{params.__qualname__}.{name}")
        for name, declared in declarations(params).items()
    }


def shape_at(shape: Shape, steps: Iterable[str]) -> Shape | None:
    """Return the shape at a path below another; None if no such key exists."""
    for step in steps:
        below = shapes_of(shape.params).get(step) if shape.params is not None else shape.inner
        if below is None:
            return None
        shape = below
    return shape


def _shape(declared: Declaration, kind: Any, place: str) -> Shape:
    """Return the allowed values of a declared type, or of a list or mapping of it."""
    shape = _of_type(declared, kind, place)
    return dataclasses.replace(shape, unit=declared.unit, description=declared.description)


def _of_type(declared: Declaration, kind: Any, place: str) -> Shape:
    """Read one type annotation of a declaration, or that of its items."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    inner = partial(_shape, declared, place=place)
    if origin is Annotated:  # an item with bounds of its own
        own = next((note for note in args[1:] if isinstance(note, Bounds)), None)
        return _of_type(dataclasses.replace(declared, bounds=own), args[0], place)
    if origin in (typing.Union, types.UnionType) and len(args) == 2 and type(None) in args:
        kept = args[0] if args[1] is type(None) else args[1]
        return dataclasses.replace(inner(kept), optional=True)
    if origin in (typing.Union, types.UnionType) and typing.get_origin(args[1]) is Literal:
        return dataclasses.replace(inner(args[0]), choices=typing.get_args(args[1]))
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return Shape("params", params=kind)
    if origin is tuple and (len(set(args)) == 1 or args[1:] == (...,)):
        return Shape("list", inner=inner(args[0]), length=None if args[-1] is ... else len(args))
    if origin is tuple:
        return Shape("row", items=tuple(map(inner, args)))
    if origin in (dict, Mapping) and args[0] is str:
        return Shape("mapping", inner=inner(args[1]))
    if origin is Literal or (declared.choices and kind in _PLAIN):
        return Shape("choice", choices=declared.choices)
    if kind in _PLAIN:
        form, bounds = _PLAIN[kind], declared.bounds
        if bounds is None:
            return Shape(form)
        if form not in ("number", "whole"):
            raise TypeError(f"{place}: Bounds are only allowed for numbers")
        if form == "number":
            return Shape(form, low=float(bounds.low), high=float(bounds.high))
        return Shape(form, low=int(bounds.low), high=int(bounds.high))
    raise TypeError(f"{place}: a configuration value cannot have the type {kind}")


def _annotation(shape: Shape) -> Any:
    """Return a shape as a pydantic type."""
    kind: Any
    match shape:
        case Shape(form="number"):
            kind = Annotated[float, Field(ge=shape.low, le=shape.high, allow_inf_nan=False)]
        case Shape(form="whole"):
            kind = Annotated[int, Field(ge=shape.low, le=shape.high)]
        case Shape(form="bool"):
            kind = bool
        case Shape(form="text"):
            kind = Annotated[str, AfterValidator(_printable)]
        case Shape(form="value"):
            kind = Any
        case Shape(form="choice"):
            kind = Annotated[
                Literal[shape.choices], BeforeValidator(partial(_check_exact_type, shape))
            ]
        case Shape(form="list", inner=Shape() as inner):
            length = Field(min_length=shape.length, max_length=shape.length)
            kind = Annotated[types.GenericAlias(tuple, (_annotation(inner), ...)), length]
        case Shape(form="row"):
            kind = types.GenericAlias(tuple, tuple(map(_annotation, shape.items)))
        case Shape(form="mapping", inner=Shape() as inner):
            kind = types.GenericAlias(
                dict, (Annotated[str, AfterValidator(_printable)], _annotation(inner))
            )
        case Shape(params=type() as params):
            kind = _dataclass_type(params)
            if shape.choices:
                kind |= Literal[shape.choices]
    return kind | None if shape.optional else kind


def _dataclass_type(params: type) -> Any:
    """Return a dataclass as a pydantic type that yields the dataclass itself."""
    return Annotated[model_of(params), WrapValidator(partial(_build, params))]


def _printable(text: str) -> str:
    """Reject text that cannot be displayed, written to a file or distinguished from other text."""
    if len(text) > _LONGEST_TEXT:
        raise PydanticCustomError(
            "value_error", "", {"error": f"is longer than {_LONGEST_TEXT} characters; shorten it"}
        )
    # Control characters, surrogates, line ends, directional formatting.
    kinds = ("Cc", "Cs", "Zl", "Zp")
    strange = next((c for c in text if unicodedata.category(c) in kinds or c in _TURNS), None)
    if strange is not None:
        raise PydanticCustomError(
            "value_error",
            "",
            {"error": f"contains U+{ord(strange):04X}, which cannot be shown; remove it"},
        )
    return text


def _check_exact_type(shape: Shape, value: object) -> object:
    """Reject 57600.0 for 57600, which Literal accepts as equal."""
    if isinstance(value, float) and not any(isinstance(c, float) for c in shape.choices):
        raise PydanticCustomError("literal_error", "not a whole number")
    return value


def _build(params: type, value: object, validate: Callable[[object], BaseModel]) -> object:
    """Return the dataclass; its ``__post_init__`` may raise ValueError."""
    if isinstance(value, params):  # a default value from the declaring dataclass
        return value
    model = validate(value)
    return params(**{name: getattr(model, name) for name in model.model_fields_set})


@cache
def _adapter(params: type) -> TypeAdapter[Any]:
    """Return the validator of a whole file."""
    return TypeAdapter(_dataclass_type(params))


def _is_miscount(details: ErrorDetails) -> bool:
    """Return whether a length error only results from omitted faulty items."""
    return details["type"] in ("too_short", "too_long") and (
        len(details["input"]) != details["ctx"]["actual_length"]
    )


_LEFT_OUT: Any = object()


def _fill(
    shape: Shape, data: Any, path: tuple[Step, ...], faulty: Container[tuple[Step, ...]], high: bool,
    misspelt: bool,
) -> Any:  # fmt: skip
    """Return the value at a path from ``data``, except for its faulty parts."""
    if path in faulty:
        return _stand_in(shape, high)
    if data is None or (shape.params is not None and data in shape.choices):
        return data
    parts: dict[Any, Any]
    match shape:
        case Shape(params=type() as params):
            parts = {f.name: _default(f) for f in dataclasses.fields(params)}
            for name, field in shapes_of(params).items():
                if name in data or (*path, name) in faulty:
                    parts[name] = _fill(
                        field, data.get(name), (*path, name), faulty, high, misspelt
                    )
                elif misspelt and set(data) - set(
                    parts
                ):  # an unknown key may be a misspelling of this one
                    parts[name] = _stand_in(field, high)
            return _without_post_init(params, parts)
        case Shape(form="row"):
            rows = enumerate(zip(shape.items, data, strict=False))
            return tuple(
                _fill(s, item, (*path, k), faulty, high, misspelt) for k, (s, item) in rows
            )
        case Shape(inner=Shape() as inner):
            steps = data.items() if isinstance(data, dict) else enumerate(data)
            parts = {k: _fill(inner, item, (*path, k), faulty, high, misspelt) for k, item in steps}
            if any(part is _LEFT_OUT for part in parts.values()):
                return _LEFT_OUT
            return parts if isinstance(data, dict) else tuple(parts.values())
    return float(data) if shape.form == "number" else data


def _stand_in(shape: Shape, high: bool) -> Any:
    """Return the lowest or highest allowed value of a position."""
    match shape:
        case Shape(form="number" | "whole"):
            least = shape.low if shape.low is not None else 0.0
            end = (shape.high if shape.high is not None else least + 1.0) if high else least
            return int(end) if shape.form == "whole" else float(end)
        case Shape(form="bool"):
            return high
        case Shape(form="text"):
            return "?" if high else ""
        case Shape(form="choice"):
            return shape.choices[-1 if high else 0]
        case Shape(params=type() as params):
            fields = shapes_of(params).items()
            return _without_post_init(
                params, {name: _stand_in(field, high) for name, field in fields}
            )
    return _LEFT_OUT


def _default(declared: dataclasses.Field[Any]) -> Any:
    """Return a field's default, if it has one."""
    if declared.default_factory is not dataclasses.MISSING:
        return declared.default_factory()
    return _LEFT_OUT if declared.default is dataclasses.MISSING else declared.default


def _without_post_init(params: type, parts: Mapping[str, Any]) -> Any:
    """Return a dataclass instance without running its ``__post_init__``."""
    made: object = object.__new__(params)
    for name, part in parts.items():
        if part is not _LEFT_OUT:
            object.__setattr__(made, name, part)
    return made

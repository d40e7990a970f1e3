"""Copies of machines that have been running: made and started once, for many tests.

A copy is as good as a machine of its own. Objects that a closure or a list's method holds on to is
copied as well, which copy.deepcopy alone leaves with the original.
"""

import copy
import struct
from types import BuiltinMethodType, CellType, FunctionType, ModuleType
from typing import Any
from unittest.mock import patch


def _function(function: FunctionType, memo: dict[int, Any]) -> FunctionType:
    if not function.__closure__:
        return function
    cells = tuple(CellType() for _ in function.__closure__)
    made = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, cells
    )
    made.__kwdefaults__ = function.__kwdefaults__
    memo[id(function)] = made
    for cell, old in zip(cells, function.__closure__, strict=True):
        cell.cell_contents = copy.deepcopy(old.cell_contents, memo)
    return made


def _method(method: BuiltinMethodType, memo: dict[int, Any]) -> Any:
    owner = method.__self__
    if owner is None or type(owner) is type(copy):
        return method
    return getattr(copy.deepcopy(owner, memo), method.__name__)


def _same(thing: Any, memo: dict[int, Any]) -> Any:
    return thing


_UNCHANGING: dict[int, tuple[Any, ...]] = {}
"""Tuples, also named ones, that were found to hold nothing that changes, by id: large tables.

Kept, so that no other tuple gets the id.
"""


def _tuple(thing: tuple[Any, ...], memo: dict[int, Any]) -> tuple[Any, ...]:
    if id(thing) in _UNCHANGING:
        return thing
    made: tuple[Any, ...] = _COPY_TUPLE(thing, memo)
    if made is thing:
        _UNCHANGING[id(thing)] = thing
        return thing
    return made if type(thing) is tuple else type(thing)(*made)


_COPY_TUPLE = copy._deepcopy_dispatch[tuple]  # type: ignore[attr-defined]

_WAYS = {
    FunctionType: _function,
    BuiltinMethodType: _method,
    tuple: _tuple,
    struct.Struct: _same,
    ModuleType: _same,
}


def copied(thing: Any) -> Any:
    """Return a deep copy that shares nothing that changes."""
    named = {kind: _tuple for kind in tuple.__subclasses__() if hasattr(kind, "_fields")}
    with patch.dict(copy._deepcopy_dispatch, {**named, **_WAYS}):  # type: ignore[attr-defined]
        return copy.deepcopy(thing)

"""A Params dataclass as a strict model: types, bounds, choices, and the words of a refusal."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest

from gazerig.config.validation import fill, validate
from gazerig.params import Bounds, Choices, Declaration


@dataclass(frozen=True, slots=True)
class Lid:
    """How a lid moves.

    More words that are no headline.
    """

    shut_ms: Annotated[float, Bounds(40, 200), "time to shut"] = 90.0
    open_ms: Annotated[float, Bounds(40, 1e9)] = 150.0
    blinks: bool = True

    def __post_init__(self) -> None:
        if self.shut_ms > self.open_ms:
            raise ValueError("shut_ms must not be\nabove open_ms")


@dataclass(frozen=True, slots=True)
class Eye:
    id: Annotated[int, Bounds(0, 252), "servo id"]
    name: str = "eye"
    lid: Lid = Lid()
    spare: Lid | None = None
    lids: Mapping[str, Lid] = field(default_factory=dict)
    kind: Annotated[str, Choices("gamma", "lognormal")] = "gamma"
    side: Literal["left", "right"] = "left"
    baud: Annotated[Literal[57_600, 1_000_000], "speed of the line"] = 57_600
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    matrix: Annotated[tuple[tuple[float, ...], ...], Bounds(0, 1)] = ()
    pair: Annotated[tuple[int, int], Bounds(-9, 9)] = (1, 2)
    tags: tuple[str, ...] = ()
    gains: Annotated[dict[str, float], Bounds(-1, 1)] = field(default_factory=dict)


def refused(data: dict[str, Any]) -> list[str]:
    """Judge an Eye and give its faults as "path: rule"."""
    value, errors = validate(Eye, {"id": 1, **data})
    assert (value is None) == bool(errors)
    return [f"{'.'.join(map(str, c.path))}: {c.rule}" for c in errors]


@pytest.mark.parametrize(
    "data",
    [
        {},
        {"id": 0},
        {"id": 252},
        {"offset_m": (1, 2.5, -3)},
        {"matrix": ((0, 1), (0.5,), ())},
        {"pair": (9, -9)},
        {"tags": ("a", "b")},
        {"gains": {"a": -1, "b": 1.0}},
        {"lid": {}, "spare": None, "lids": {"upper": {"shut_ms": 40}}},
        {"spare": {"shut_ms": 200, "open_ms": 200}},
        {"baud": 1_000_000, "kind": "lognormal", "side": "right"},
    ],
)
def test_right_values_are_taken(data: dict[str, Any]) -> None:
    assert refused(data) == []


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        ({"id": True}, "id: True is a truth value, wanted a whole number, 0 to 252"),
        ({"id": 1.0}, "id: 1.0 is a number, wanted a whole number, 0 to 252"),
        ({"id": "1"}, "id: '1' is text, wanted a whole number, 0 to 252; remove the quotes"),
        ({"id": 253}, "id: 253 is above 252"),
        ({"id": None}, "id: is empty, wanted a whole number, 0 to 252"),
        ({"name": 5}, "name: 5 is a whole number, wanted text; put it in quotes"),
        (
            {"kind": "gama"},
            "kind: 'gama' is not one of 'gamma', 'lognormal'; did you mean 'gamma'?",
        ),
        ({"side": "up"}, "side: 'up' is not one of 'left', 'right'"),
        ({"baud": 9600}, "baud: 9600 is a whole number, wanted one of 57600, 1000000"),
        ({"offset_m": (1, 2)}, "offset_m: has length 2, wanted 3"),
        ({"offset_m": (1, 2, 3, 4)}, "offset_m: has length 4, wanted 3"),
        ({"offset_m": 1}, "offset_m: 1 is a whole number, wanted a list of 3, each a number in m"),
        ({"pair": (1,)}, "pair: has length 1, wanted 2"),
        ({"pair": (1, 10)}, "pair.1: 10 is above 9"),
        ({"matrix": ((0, 1), (0, 1.5))}, "matrix.1.1: 1.5 is above 1"),
        ({"matrix": (0,)}, "matrix.0: 0 is a whole number, wanted a list, each a number, 0 to 1"),
        ({"tags": "a"}, "tags: 'a' is text, wanted a list, each text"),
        ({"gains": {"a": -2}}, "gains.a: -2 is below -1"),
        ({"gains": {"a": float("nan")}}, "gains.a: nan is not a finite number"),
        ({"gains": ()}, "gains: is a list, wanted a mapping, each key with a number, -1 to 1"),
        ({"lid": {"shut_ms": 39}}, "lid.shut_ms: 39 is below 40 (unit ms)"),
        ({"lid": {"shut_ms": float("inf")}}, "lid.shut_ms: inf is not a finite number"),
        (
            {"lid": {"open_ms": "1 s"}},
            "lid.open_ms: '1 s' is text, wanted a number, 40 to 1000000000 ms",
        ),
        ({"lid": {"blinks": "no"}}, "lid.blinks: 'no' is text, wanted true or false"),
        ({"lid": {"blinks": 1}}, "lid.blinks: 1 is a whole number, wanted true or false"),
        ({"lid": None}, "lid: is empty, wanted a mapping with the keys shut_ms, open_ms, blinks"),
        (
            {"spare": 1},
            "spare: 1 is a whole number, "
            "wanted a mapping with the keys shut_ms, open_ms, blinks or null",
        ),
        ({"lid": {"shut_ms": 160}}, "lid: shut_ms must not be above open_ms"),
        ({"lids": {"upper": {"open_ms": 50}}}, "lids.upper: shut_ms must not be above open_ms"),
        (
            {"lid": {"shut": 50}},
            "lid.shut: unknown key 'shut'; did you mean 'shut_ms'? "
            "allowed: shut_ms, open_ms, blinks",
        ),
        (
            {"lid": {"zzz": 50}},
            "lid.zzz: unknown key 'zzz'; allowed: shut_ms, open_ms, blinks",
        ),
    ],
)
def test_wrong_values_are_refused_in_words(data: dict[str, Any], fault: str) -> None:
    assert refused(data) == [fault]


def test_a_missing_key_is_named_with_its_range_and_meaning() -> None:
    _, errors = validate(Eye, {})
    assert [error.rule for error in errors] == [
        "missing; wanted a whole number, 0 to 252 (servo id)"
    ]


def test_a_default_outside_its_own_bounds_is_found() -> None:
    @dataclass(frozen=True)
    class Slip:
        rate_hz: Annotated[float, Bounds(0, 200)] = 500.0

    _, errors = validate(Slip, {})
    assert [error.rule for error in errors] == ["500.0 is above 200 (unit Hz)"]


def test_a_value_beside_faults_ends_the_rules_that_read_them() -> None:
    data = {"id": 1, "lid": {"shut": 60, "blinks": True}, "gains": {"a": 0.5}}
    eye = fill(Declaration("params", params=Eye), data, {("lid", "shut_ms"), ("gains", "a")})
    assert (eye.id, eye.lid.blinks, eye.lid.open_ms) == (1, True, 150.0)
    for read in (lambda: eye.lid.shut_ms > 50.0, lambda: eye.gains["a"] in (0.5,)):
        with pytest.raises((AttributeError, TypeError)):
            read()

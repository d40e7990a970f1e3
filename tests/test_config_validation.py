"""A Params dataclass as a strict model: types, bounds, choices, and the words of a refusal."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest

from gazerig.config.validation import validate
from gazerig.params import Bounds, Choices


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
    return [f"{one.key}: {one.rule}" for one in errors]


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
        ({"id": None}, "id: is empty, wanted a whole number, 0 to 252"),
        ({"name": 5}, "name: is 5, wanted text"),
        ({"baud": 9600}, "baud: is 9600, wanted 57600 or 1000000"),
        ({"offset_m": (1, 2)}, "offset_m: is [1, 2], wanted a list of 3, each a number in m"),
        (
            {"offset_m": (1, 2, 3, 4)},
            "offset_m: is [1, 2, 3, 4], wanted a list of 3, each a number in m",
        ),
        ({"pair": (1, 10)}, "pair.1: is 10, wanted a whole number, -9 to 9"),
        ({"gains": {"a": float("nan")}}, "gains.a: is nan, wanted a number, -1 to 1"),
        ({"gains": ()}, "gains: is [], wanted a mapping, each a number, -1 to 1"),
        (
            {"lid": {"open_ms": "1 s"}},
            "lid.open_ms: is '1 s', wanted a number, 40 to 1000000000 ms",
        ),
        ({"lid": {"blinks": 1}}, "lid.blinks: is 1, wanted true or false"),
        (
            {"spare": 1},
            "spare: is 1, wanted a mapping with the keys shut_ms, open_ms, blinks or null",
        ),
        ({"lid": {"shut_ms": 160}}, "lid: shut_ms must not be above open_ms"),
        (
            {"lids": {"upper": {"shut": 50}}},
            "lids.upper.shut: unknown key; did you mean 'shut_ms'? "
            "allowed: shut_ms, open_ms, blinks",
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
    assert [error.rule for error in errors] == ["is 500.0, wanted a number, 0 to 200 Hz"]

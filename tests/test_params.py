"""One line declares a parameter; its unit is in its name."""

from dataclasses import dataclass, fields
from typing import Annotated, Literal

import pytest

from gazerig.config.bounds import Shape, shapes_of
from gazerig.config.schema import Rig
from gazerig.params import Bounds, Choices, Unit, choices_of, declarations, unit_of


@dataclass(frozen=True)
class Lamp:
    bright_percent: Annotated[float, Bounds(0, 100), "how bright"] = 50.0
    colours: Annotated[tuple[Literal["red", "blue"], ...], "which"] = ()
    channel: Annotated[int, Choices(6, 12), Unit("pins")] = 6
    bare: float = 1.0


def test_a_declaration_says_all_of_a_parameter() -> None:
    declared = declarations(Lamp)
    bright = declared["bright_percent"]
    assert (bright.kind, bright.bounds, bright.choices) == (float, Bounds(0, 100), ())
    assert (bright.unit, bright.description) == ("%", "how bright")
    assert choices_of(Lamp, "colours") == ("red", "blue")
    assert (choices_of(Lamp, "channel"), declared["channel"].unit) == ((6, 12), "pins")
    assert declared["bare"].bounds is None and list(declared) == [f.name for f in fields(Lamp)]


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("max_accel_deg_s2", "deg/s2"),
        ("max_speed_deg_s", "deg/s"),
        ("park_s", "s"),
        ("follow_per_deg", "1/deg"),
        ("gaze_evoked_blink_steepness_1_deg", "1/deg"),
        ("baud", "bit/s"),
        ("strength", ""),
        ("class", ""),
    ],
)
def test_a_unit_is_the_end_of_the_name(name: str, unit: str) -> None:
    assert unit_of(name) == unit


def shapes(params: type) -> list[Shape]:
    found = list(shapes_of(params).values())
    for shape in list(found):
        inner = shape.inner or shape
        if inner.params is not None:
            found += shapes(inner.params)
    return found


def test_every_parameter_of_a_rig_is_described_and_every_number_bounded() -> None:
    every = shapes(Rig)
    assert len(every) > 350 and all(shape.description for shape in every)
    numbers = [shape for shape in every if shape.form in ("number", "whole")]
    assert len(numbers) > 250 and all(shape.low is not None for shape in numbers)

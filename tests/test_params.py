"""One line declares a parameter; its unit is in its name."""

from gazerig.config.schema import Rig
from gazerig.params import Declaration, declarations


def shapes(params: type) -> list[Declaration]:
    found = list(declarations(params).values())
    for shape in list(found):
        inner = shape.inner or shape
        if inner.params is not None:
            found += shapes(inner.params)
    return found


def test_every_parameter_of_a_rig_is_described_and_every_number_bounded() -> None:
    every = shapes(Rig)
    assert len(every) > 150 and all(shape.description for shape in every)
    numbers = [shape for shape in every if shape.form in ("number", "whole")]
    assert len(numbers) > 60 and all(shape.low is not None for shape in numbers)

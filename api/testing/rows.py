"""Feedback of a bus as one row per servo, for tests; the product has columns."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

from gazerig.drivers.types import Feedback

T = TypeVar("T")


class Row(NamedTuple):
    """One servo's part of a ``Feedback``; the fields are its columns."""

    position_steps: float
    velocity_steps_s: float
    load: float
    at_s: float
    temperature_c: float | None
    voltage_v: float | None
    torque: bool
    fault: str
    measured: bool
    rearmed: bool


def rows(feedback: Feedback) -> tuple[Row | None, ...]:
    """Return one row per servo, None for a servo without a fresh answer."""
    every = zip(*feedback[:-1], strict=True)
    return tuple([None if i in feedback.missing else Row(*row) for i, row in enumerate(every)])


def feedback_of(given: list[Row | None]) -> Feedback:
    """Return the feedback that consists of these rows."""
    none = Feedback.of_none(1)
    columns: Any = (column[0] for column in none[:-1])
    blank = Row(*columns)
    every: Any = zip(*[blank if row is None else row for row in given], strict=True)
    missing = tuple(i for i, row in enumerate(given) if row is None)
    return Feedback(*(*every, missing))


def well(readings: Sequence[Row | None]) -> bool:
    """Return whether all servos have answered with their torque on."""
    return all(row is not None and row.torque for row in readings)


def present(thing: T | None) -> T:
    """Return the argument; fail if it is None."""
    assert thing is not None
    return thing

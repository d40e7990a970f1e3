"""Feedback of a bus, one row per servo."""

from typing import Any, NamedTuple

from gazerig.drivers.types import Feedback


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
    none = Feedback.create_missing(1)
    columns: Any = (column[0] for column in none[:-1])
    blank = Row(*columns)
    every: Any = zip(*[blank if row is None else row for row in given], strict=True)
    missing = tuple(i for i, row in enumerate(given) if row is None)
    return Feedback(*(*every, missing))

"""Hobby servos, independent of the board that sends their pulses."""

from typing import NamedTuple

US_STEPS = 4
"""Steps per microsecond: pulse widths are counted in quarter microseconds."""


class HobbyModel(NamedTuple):
    """A hobby servo: its shaft turns with the pulse width, and it has no feedback.

    steps_per_turn: quarter microseconds per turn, extrapolated
    lowest, highest: range of pulse widths, quarter microseconds
    """

    name: str
    steps_per_turn: float
    lowest: int
    highest: int


HOBBY = {
    # 1000..2000 us are usually 90 deg; most servos accept 500..2500 us.
    model.name: model
    for model in (HobbyModel("hobby", 1000 * US_STEPS * 4.0, 500 * US_STEPS, 2500 * US_STEPS),)
}

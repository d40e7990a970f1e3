"""Hobby servos, whatever board sends their pulses."""

from typing import NamedTuple

US_STEPS = 4
"""Pulse widths are counted in quarters of a microsecond."""


class HobbyModel(NamedTuple):
    """A hobby servo: its shaft turns with the pulse width, and it gives no feedback.

    steps_per_turn: quarter microseconds that would be one turn
    lowest, highest: pulse widths that such servos take, quarter microseconds
    """

    name: str
    steps_per_turn: float
    lowest: int
    highest: int


HOBBY = {
    # 1000..2000 us are 90 deg by custom; most take 500..2500 us.
    model.name: model
    for model in (HobbyModel("hobby", 1000 * US_STEPS * 4.0, 500 * US_STEPS, 2500 * US_STEPS),)
}

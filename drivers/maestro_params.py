"""How to speak with a Pololu Maestro, and the servos behind it: what a rig file may choose.

Source: Pololu Maestro Servo Controller User's Guide (0J40).
"""

from dataclasses import dataclass, field
from typing import NamedTuple

US_STEPS = 4
"""The board counts pulse widths in quarters of a microsecond."""


class HobbyModel(NamedTuple):
    """A hobby servo: its shaft turns with the pulse width, and it tells nothing.

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


@dataclass(frozen=True, slots=True)
class MaestroParams:
    """How to speak with one board."""

    baud: int = field(
        default=115_200,
        metadata={
            "choices": (9600, 38_400, 57_600, 115_200, 200_000),
            "unit": "bit/s",
            "says": "Speed of its serial pins; its USB port takes any.",
        },
    )

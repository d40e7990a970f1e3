"""Communication parameters of a Dynamixel bus, set in a rig file."""

from dataclasses import dataclass
from typing import Annotated, Literal


@dataclass(frozen=True, slots=True)
class DynamixelParams:
    """Communication parameters of the servos."""

    # fmt: off
    baud: Annotated[Literal[57600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000],
        "Speed of the bus; the servos must be set to the same speed."] = 1_000_000
    # fmt: on

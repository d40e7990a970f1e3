"""Communication parameters of a Feetech bus, set in a rig file."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.drivers.feetech.memory_table import BAUD_RATES
from gazerig.params import Choices


@dataclass(frozen=True, slots=True)
class FeetechParams:
    """Communication parameters of the servos."""

    # fmt: off
    baud: Annotated[int, Choices(*BAUD_RATES[::-1]), "Speed of the bus; the servos must be set to the same speed."] = 1_000_000
    # fmt: on

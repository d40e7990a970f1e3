"""How to speak with the Feetech servos of one bus: what a rig file may choose."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gazerig.drivers.feetech.memory_table import BAUD_RATES
from gazerig.params import Bounds, Choices, Unit


@dataclass(frozen=True, slots=True)
class FeetechParams:
    """How to speak with the servos."""

    # fmt: off
    baud: Annotated[int, Choices(*BAUD_RATES[::-1]), "Speed of the bus; the servos must be set to the same."] = 1_000_000
    reply_timeout_ms: Annotated[float, Bounds(1, 200), "Longest patience for an answer beyond the time its bytes take on the wire."] = 20.0
    prompt_timeout_ms: Annotated[float, Bounds(0.2, 200), "Shortest patience; between the two it is twice the worst delay measured."] = 1.0
    give_up_s: Annotated[float, Bounds(0.5, 3600), "Wait so long for an unplugged adapter or servos without power to come back."] = 60.0
    torque_every: Annotated[int, Bounds(1, 100), Unit("reads"),
        "Every so many reads also tell whether torque and settings are still there."] = 8
    # fmt: on
    watchdog_ms: ClassVar[int] = 0
    """These servos have none."""

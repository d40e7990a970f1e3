"""Communication parameters of a Feetech bus, set in a rig file."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gazerig.drivers.feetech.memory_table import BAUD_RATES
from gazerig.params import Bounds, Choices, Unit


@dataclass(frozen=True, slots=True)
class FeetechParams:
    """Communication parameters of the servos."""

    # fmt: off
    baud: Annotated[int, Choices(*BAUD_RATES[::-1]), "Speed of the bus; the servos must be set to the same speed."] = 1_000_000
    reply_timeout_ms: Annotated[float, Bounds(1, 200), "Longest time-out of a reply, added to the transmission time of its bytes."] = 20.0
    prompt_timeout_ms: Annotated[float, Bounds(0.2, 200),
        "Shortest time-out of a reply; between the two it adapts to twice the worst delay measured."] = 1.0
    give_up_s: Annotated[float, Bounds(0.5, 3600),
        "The run ends when an unplugged adapter or unpowered servos have not reconnected within this time."] = 60.0
    torque_every: Annotated[int, Bounds(1, 100), Unit("reads"),
        "Every n-th read also checks whether torque and settings are still as they were set."] = 8
    # fmt: on
    watchdog_ms: ClassVar[int] = 0
    """These servos have no watchdog."""

"""Communication parameters of a Dynamixel bus, set in a rig file."""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True, slots=True)
class DynamixelParams:
    """Communication parameters of the servos."""

    # fmt: off
    baud: Annotated[Literal[57600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000],
        "Speed of the bus; the servos must be set to the same speed."] = 1_000_000
    reply_timeout_ms: Annotated[float, Bounds(1, 200), "Longest time-out of a reply, added to the transmission time of its bytes."] = 20.0
    prompt_timeout_ms: Annotated[float, Bounds(0.2, 200),
        "Shortest time-out of a reply; between the two it adapts to twice the worst delay measured."] = 0.7
    watchdog_ms: Annotated[int, Bounds(0, 2540),
        "Servos stop by themselves when they receive no packet for this long, in steps of 20; 0: never."] = 200
    give_up_s: Annotated[float, Bounds(0.5, 3600),
        "The run ends when an unplugged adapter or unpowered servos have not reconnected within this time."] = 60.0
    fast_sync_read: Annotated[bool, "Read all servos with one reply packet (Fast Sync Read) if their firmware supports it."] = True
    indirect_block: Annotated[bool, "Read torque, errors, temperature and voltage with every position."] = True
    # fmt: on

    def __post_init__(self) -> None:
        """Reject a watchdog shorter than its smallest step."""
        if 0 < self.watchdog_ms < 20:
            raise ValueError(f"watchdog_ms {self.watchdog_ms} is too short: 0 or 20..2540")

"""How to speak with the servos of one bus: what a rig file may choose."""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class DynamixelParams:
    """How to speak with the servos."""

    baud: int = field(
        default=1_000_000,
        metadata={
            "choices": (57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000),
            "unit": "bit/s",
            "says": "Speed of the bus; the servos must be set to the same.",
        },
    )
    reply_timeout_ms: float = field(
        default=20.0,
        metadata={
            "low": 1.0,
            "high": 200.0,
            "unit": "ms",
            "says": "Longest patience for an answer beyond the time its bytes take on the wire.",
        },
    )
    prompt_timeout_ms: float = field(
        default=0.7,
        metadata={
            "low": 0.2,
            "high": 200.0,
            "unit": "ms",
            "says": "Shortest patience; between the two it is twice the worst delay measured.",
        },
    )
    watchdog_ms: int = field(
        default=200,
        metadata={
            "low": 0,
            "high": 2540,
            "unit": "ms",
            "says": "Servos stop by themselves after so much silence, in steps of 20; 0: never.",
        },
    )
    give_up_s: float = field(
        default=60.0,
        metadata={
            "low": 0.5,
            "high": 3600.0,
            "unit": "s",
            "says": "Wait so long for an unplugged adapter or servos without power to come back.",
        },
    )
    fast_sync_read: bool = field(
        default=True,
        metadata={"unit": "", "says": "Read all servos in one packet where their firmware can."},
    )
    indirect_block: bool = field(
        default=True,
        metadata={
            "unit": "",
            "says": "Read torque, errors, temperature and voltage with every position.",
        },
    )

    def __post_init__(self) -> None:
        """Refuse a watchdog shorter than its smallest step."""
        if 0 < self.watchdog_ms < 20:
            raise ValueError(f"watchdog_ms {self.watchdog_ms} is too short: 0 or 20..2540")

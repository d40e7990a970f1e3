"""How to speak with the Feetech servos of one bus: what a rig file may choose."""

from dataclasses import dataclass, field

from gazerig.drivers.feetech.memory_table import BAUD_RATES


@dataclass(frozen=True, slots=True)
class FeetechParams:
    """How to speak with the servos."""

    baud: int = field(
        default=1_000_000,
        metadata={
            "choices": BAUD_RATES[::-1],
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
        default=1.0,
        metadata={
            "low": 0.2,
            "high": 200.0,
            "unit": "ms",
            "says": "Shortest patience; between the two it is twice the worst delay measured.",
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
    torque_every: int = field(
        default=8,
        metadata={
            "low": 1,
            "high": 100,
            "unit": "reads",
            "says": "Every so many reads also tell whether torque and settings are still there.",
        },
    )

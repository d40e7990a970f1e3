"""How to speak with a Pololu Maestro: what a rig file may choose.

Source: Pololu Maestro Servo Controller User's Guide (0J40).
"""

from dataclasses import dataclass, field
from typing import Literal

Form = Literal["compact", "pololu"]


@dataclass(frozen=True, slots=True)
class MaestroParams:
    """How to speak with one board."""

    baud: int = field(
        default=115_200,
        metadata={
            "choices": (9600, 19_200, 38_400, 57_600, 115_200),
            "unit": "bit/s",
            "says": "Speed of its serial pins; its USB port takes any.",
        },
    )
    protocol: Form = field(
        default="compact",
        metadata={
            "choices": ("compact", "pololu"),
            "unit": "",
            "says": "Form of the commands; pololu where several boards share one line.",
        },
    )
    device: int = field(
        default=12,
        metadata={
            "low": 0,
            "high": 127,
            "unit": "",
            "says": "The board's device number, heeded in the pololu form.",
        },
    )
    crc: bool = field(
        default=False,
        metadata={
            "unit": "",
            "says": "The board wants a check byte after every command: damaged ones do nothing.",
        },
    )
    channels: int = field(
        default=12,
        metadata={
            "choices": (6, 12, 18, 24),
            "unit": "",
            "says": "Size of the board; the Micro Maestro has 6.",
        },
    )
    reply_timeout_ms: float = field(
        default=20.0,
        metadata={
            "low": 1.0,
            "high": 200.0,
            "unit": "ms",
            "says": "Patience for an answer beyond the time its bytes take on the wire.",
        },
    )
    watch_ms: float = field(
        default=0.0,
        metadata={
            "low": 0.0,
            "high": 50.0,
            "unit": "ms",
            "says": "Ask the board so often for its errors and a channel's pulse; 0: in every "
            "read. More saves time on a slow line, but restarts are noticed later.",
        },
    )
    stagger_ms: float = field(
        default=100.0,
        metadata={
            "low": 0.0,
            "high": 1000.0,
            "unit": "ms",
            "says": "Servos without pulses start so long after one another: all at once pull a "
            "weak supply down.",
        },
    )
    give_up_s: float = field(
        default=60.0,
        metadata={
            "low": 0.5,
            "high": 3600.0,
            "unit": "s",
            "says": "Wait so long for an unplugged or silent board to come back.",
        },
    )

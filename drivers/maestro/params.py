"""How to speak with a Pololu Maestro: what a rig file may choose.

Source: Pololu Maestro Servo Controller User's Guide (0J40).
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds, Choices

Form = Literal["compact", "pololu"]


@dataclass(frozen=True, slots=True)
class MaestroParams:
    """How to speak with one board."""

    # fmt: off
    baud: Annotated[int, Choices(9600, 19200, 38400, 57600, 115_200), "Speed of its serial pins; its USB port takes any."] = 115_200
    protocol: Annotated[Form, "Form of the commands; pololu where several boards share one line."] = "compact"
    device: Annotated[int, Bounds(0, 127), "The board's device number, heeded in the pololu form."] = 12
    crc: Annotated[bool, "The board wants a check byte after every command: damaged ones do nothing."] = False
    channels: Annotated[int, Choices(6, 12, 18, 24), "Size of the board; the Micro Maestro has 6."] = 12
    reply_timeout_ms: Annotated[float, Bounds(1, 200), "Patience for an answer beyond the time its bytes take on the wire."] = 20.0
    watch_ms: Annotated[float, Bounds(0, 50),
        "Ask the board so often for its errors and a channel's pulse; 0: in every read. More saves time on a slow line, but "
        "restarts are noticed later."] = 0.0
    stagger_ms: Annotated[float, Bounds(0, 1000),
        "Servos without pulses start so long after one another: all at once pull a weak supply down."] = 100.0
    give_up_s: Annotated[float, Bounds(0.5, 3600), "Wait so long for an unplugged or silent board to come back."] = 60.0
    # fmt: on

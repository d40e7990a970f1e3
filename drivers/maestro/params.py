"""Communication parameters of a Pololu Maestro, set in a rig file.

Source: Pololu Maestro Servo Controller User's Guide (0J40).
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.params import Bounds, Choices

Form = Literal["compact", "pololu"]


@dataclass(frozen=True, slots=True)
class MaestroParams(HobbyBoardParams):
    """Communication parameters of one board."""

    # fmt: off
    baud: Annotated[int, Choices(9600, 19200, 38400, 57600, 115_200),
        "Baud rate of the board's serial pins; its USB port accepts any."] = 115_200
    protocol: Annotated[Form, "Format of the commands; pololu if several boards share one line."] = "compact"
    device: Annotated[int, Bounds(0, 127), "Device number of the board, used only with the protocol pololu."] = 12
    crc: Annotated[bool, "Whether the board is set up for a CRC byte after every command; it ignores damaged commands then."] = False
    channels: Annotated[int, Choices(6, 12, 18, 24), "Number of channels of the board; the Micro Maestro has 6."] = 12
    # fmt: on

    def pulse_range_us(self) -> tuple[float, float, str]:
        """Return the shortest and longest pulse that a board can output."""
        return 64.0, 4080.0, "the range of a Maestro"

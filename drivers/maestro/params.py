"""Communication parameters of a Pololu Maestro, set in a rig file.

Source: Pololu Maestro Servo Controller User's Guide (0J40).
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.params import Choices


@dataclass(frozen=True, slots=True)
class MaestroParams(HobbyBoardParams):
    """Communication parameters of one board on its USB command port."""

    # fmt: off
    crc: Annotated[bool, "Whether the board is set up for a CRC byte after every command; it ignores damaged commands then."] = False
    channels: Annotated[int, Choices(6, 12, 18, 24), "Number of channels of the board; the Micro Maestro has 6."] = 12
    # fmt: on
    pulse_range_us: ClassVar[tuple[float, float, str]] = (64.0, 4080.0, "the range of a Maestro")

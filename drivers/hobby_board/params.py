"""Parameters of boards of hobby servos, set in a rig file."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

US_STEPS = 4
"""Steps per microsecond: pulse widths are counted in quarter microseconds."""


STEPS_PER_TURN = 1000 * US_STEPS * 4.0
"""1000..2000 us are usually 90 deg."""

LOWEST, HIGHEST = 500 * US_STEPS, 2500 * US_STEPS
"""Range of pulse widths that most servos accept."""

HOBBY = "hobby"
"""Name of a hobby servo as a model: its shaft turns with the pulse width, without feedback."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HobbyBoardParams:
    """Properties of a board.

    baud: rate of its port: USB accepts any, and a bridge to I2C has this one
    pulse_range_us: shortest and longest pulse that may be sent, us, and the origin of both
    """

    baud: ClassVar[int] = 115_200
    pulse_range_us: ClassVar[tuple[float, float, str]]

    @property
    def channels(self) -> int:
        """Return the number of channels."""
        raise NotImplementedError

    def check_servo(self, setup: "ServoConfig") -> None:
        """Reject a servo that no channel can have.

        Raises:
            ValueError: no channel can have it; the message names the channel and the valid range.
        """
        if not 0 <= setup.id < self.channels:
            raise ValueError(f"channel {setup.id}: the board has channels 0 to {self.channels - 1}")
        low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
        least, most, decided = self.pulse_range_us
        if not least <= low <= high <= most:
            raise ValueError(
                f"channel {setup.id}: its range {low:g}..{high:g} us must be within "
                f"{least:g}..{most:g} us ({decided}): narrow the joint's range"
            )

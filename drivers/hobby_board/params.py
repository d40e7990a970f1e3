"""Parameters of boards of hobby servos, set in a rig file."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, NamedTuple

from gazerig.params import Bounds

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

US_STEPS = 4
"""Steps per microsecond: pulse widths are counted in quarter microseconds."""


class HobbyModel(NamedTuple):
    """A hobby servo: its shaft turns with the pulse width, and it has no feedback.

    steps_per_turn: quarter microseconds per turn, extrapolated
    lowest, highest: range of pulse widths, quarter microseconds
    """

    name: str
    steps_per_turn: float
    lowest: int
    highest: int


HOBBY = {
    # 1000..2000 us are usually 90 deg; most servos accept 500..2500 us.
    model.name: model
    for model in (HobbyModel("hobby", 1000 * US_STEPS * 4.0, 500 * US_STEPS, 2500 * US_STEPS),)
}


@dataclass(frozen=True, slots=True, kw_only=True)
class HobbyBoardParams(ABC):
    """Time-outs of a board, the period of its checks, and how its servos start."""

    # fmt: off
    reply_timeout_ms: Annotated[float, Bounds(1, 200),
        "Time-out of a reply, added to the transmission time of its bytes on a serial line."] = 20.0
    watch_ms: Annotated[float, Bounds(0, 50),
        "Interval at which the board's status and the pulse of one channel are read; 0: in every read. A longer interval saves time "
        "on a slow line, but restarts are detected later."] = 0.0
    stagger_ms: Annotated[float, Bounds(0, 1000),
        "Delay between switching on the pulses of one servo and of the next; all at once could overload a weak power supply."] = 100.0
    give_up_s: Annotated[float, Bounds(0.5, 3600), "The run ends when a lost port or board has not reconnected within this time."] = 60.0
    # fmt: on

    @property
    @abstractmethod
    def channels(self) -> int:
        """Return the number of channels."""

    @abstractmethod
    def pulse_range_us(self) -> tuple[float, float, str]:
        """Return the shortest and longest pulse that may be sent, us, and the origin of both."""

    def check_servo(self, setup: "ServoConfig") -> None:
        """Reject a servo that no channel can have.

        Raises:
            ValueError: no channel can have it; the message names the channel and the valid range.
        """
        if not 0 <= setup.id < self.channels:
            raise ValueError(f"channel {setup.id}: the board has channels 0 to {self.channels - 1}")
        low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
        least, most, decided = self.pulse_range_us()
        if not least <= low <= high <= most:
            raise ValueError(
                f"channel {setup.id}: its range {low:g}..{high:g} us must be within "
                f"{least:g}..{most:g} us ({decided}): narrow the joint's range"
            )

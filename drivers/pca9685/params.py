"""Parameters of PCA9685 boards, set in a rig file."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.params import Bounds

PULSES_HZ = 50.0
"""Analogue servos need 50 pulses per second."""

CHANNELS, COUNTS = 16, 4096
LEAST_PRESCALE = 3

RESERVED = (0x70, *range(0x78, 0x80))
"""All boards answer at 70 after power-up; from 78 on addresses have another meaning on I2C."""

ADDRESSES = tuple(address for address in range(0x40, 0x80) if address not in RESERVED)


@dataclass(frozen=True, slots=True)
class Pca9685Params(HobbyBoardParams):
    """Addresses and timing of the boards of one I2C bus."""

    # fmt: off
    address: Annotated[int, Bounds(0x40, 0x77), "I2C address of the board; 0x40 (64) unless address jumpers are closed."] = 0x40
    further_addresses: Annotated[tuple[Annotated[int, Bounds(0x40, 0x77)], ...],
        "I2C addresses of more boards on the same bus; the first channel of the second board is id 16."] = ()
    oscillator_hz: Annotated[float, Bounds(22_000_000, 28_000_000),
        "Frequency of the boards' oscillators. It differs from board to board by some percent, and the pulse widths with it."] = 25e6
    # fmt: on
    pulse_range_us: ClassVar[tuple[float, float, str]] = (500.0, 2500.0, "what most servos accept")

    def __post_init__(self) -> None:
        """Check that the values are consistent.

        Raises:
            ValueError: they are not; the message names them.
        """
        for address in set(self.addresses).intersection(RESERVED):
            raise ValueError(f"address {address:#x} is reserved: boards have 0x40 to 0x77")
        if len(set(self.addresses)) < len(self.addresses):
            raise ValueError("two boards have the same address: each needs its own")

    @property
    def addresses(self) -> tuple[int, ...]:
        """Return the addresses of all boards, in their order."""
        return (self.address, *self.further_addresses)

    @property
    def prescale(self) -> int:
        """Return the divider of the oscillator for the rate of the pulses."""
        return max(LEAST_PRESCALE, round(self.oscillator_hz / (COUNTS * PULSES_HZ)) - 1)

    @property
    def channels(self) -> int:
        """Return the number of channels of all boards."""
        return CHANNELS * len(self.addresses)

"""Parameters of PCA9685 boards, set in a rig file."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.pca9685.registers import CHANNELS, MOST_PRESCALE, PulseClock, prescale_of
from gazerig.params import Bounds

BRIDGE_BAUD = 115_200
"""Baud rate of a bridge's serial line; the rate of an I2C bus is set in the system."""

RESERVED = (0x70, *range(0x78, 0x80))
"""All boards answer at 70 after power-up; from 78 on addresses have another meaning on I2C."""


@dataclass(frozen=True, slots=True)
class Pca9685Params(HobbyBoardParams):
    """Addresses and timing of the boards of one I2C bus."""

    # fmt: off
    address: Annotated[int, Bounds(0x40, 0x77), "I2C address of the board; 0x40 (64) unless address jumpers are closed."] = 0x40
    further_addresses: Annotated[tuple[int, ...], Bounds(0x40, 0x77),
        "I2C addresses of more boards on the same bus; the first channel of the second board is id 16."] = ()
    frequency_hz: Annotated[float, Bounds(40, 330), "Pulses per second; analogue servos need 50, many digital servos accept more."] = 50.0
    oscillator_hz: Annotated[float, Bounds(22_000_000, 28_000_000),
        "Frequency of the board's oscillator. It differs from board to board by some percent, and the pulse widths with it."] = 25e6
    further_oscillators_hz: Annotated[tuple[float, ...], Bounds(22_000_000, 28_000_000),
        "Oscillator frequencies of the further boards, in their order; oscillator_hz for those left out."] = ()
    min_pulse_us: Annotated[float, Bounds(100, 3000), "Shortest pulse that is ever sent."] = 500.0
    max_pulse_us: Annotated[float, Bounds(100, 3000), "Longest pulse that is ever sent."] = 2500.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the values are consistent.

        Raises:
            ValueError: they are not; the message names them.
        """
        for address in self.addresses:
            if address in RESERVED:
                raise ValueError(f"address {address:#x} is reserved: boards have 0x40 to 0x77")
        if len(set(self.addresses)) < len(self.addresses):
            raise ValueError("two boards have the same address: each needs its own")
        if self.min_pulse_us >= self.max_pulse_us:
            raise ValueError("min_pulse_us must be below max_pulse_us")
        if not self.max_pulse_us < 0.95e6 / self.frequency_hz:
            raise ValueError(
                f"max_pulse_us {self.max_pulse_us:g} does not fit between pulses at "
                f"{self.frequency_hz:g} Hz: lower frequency_hz"
            )
        if len(self.further_oscillators_hz) > len(self.further_addresses):
            raise ValueError("further_oscillators_hz has more clocks than further_addresses boards")
        if any(clock.prescale > MOST_PRESCALE for clock in self.clocks.values()):
            raise ValueError("frequency_hz is too low for this oscillator_hz")

    def pulse_range_us(self) -> tuple[float, float, str]:
        """Return the shortest and longest pulse that may be sent."""
        return self.min_pulse_us, self.max_pulse_us, "min_pulse_us, max_pulse_us"

    @property
    def addresses(self) -> tuple[int, ...]:
        """Return the addresses of all boards, in their order."""
        return (self.address, *self.further_addresses)

    @property
    def clocks(self) -> dict[int, PulseClock]:
        """Return the clock of each board by its address."""
        known = (self.oscillator_hz, *self.further_oscillators_hz)
        rest = (self.oscillator_hz,) * (len(self.addresses) - len(known))
        return {
            address: PulseClock(hz, prescale_of(self.frequency_hz, hz))
            for address, hz in zip(self.addresses, (*known, *rest), strict=True)
        }

    @property
    def channels(self) -> int:
        """Return the number of channels of all boards."""
        return CHANNELS * len(self.addresses)

    @property
    def baud(self) -> int:
        """Return the baud rate of a bridge's serial line."""
        return BRIDGE_BAUD

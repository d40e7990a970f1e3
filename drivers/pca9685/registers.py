"""Registers of a PCA9685 and their contents; pure, nothing is sent here.

Source: NXP, PCA9685 data sheet, rev. 4 (16 April 2015), section 7.3.
"""

from collections.abc import Sequence
from math import ceil, floor
from typing import NamedTuple

MODE1, MODE2 = 0x00, 0x01
LED0, ALL_LED, PRESCALE = 0x06, 0xFA, 0xFE
BYTES = 4
"""Bytes of one channel: ON low and high, OFF low and high."""

RESTART, EXTCLK, AUTO_INCREMENT, SLEEP = 0x80, 0x40, 0x20, 0x10
AWAKE = AUTO_INCREMENT
"""MODE1 in operation: the board does not answer at the all-call address."""
TOTEM_POLE = 0x04
"""MODE2: outputs drive high and low, and change at the stop condition, never within a pulse."""
FULL_OFF = 0x10
"""Bit in the high byte of OFF: no pulses, for any value of ON (7.3.3)."""

CHANNELS, COUNTS = 16, 4096
LEAST_PRESCALE = 3
START_S = 0.001
"""The oscillator is stable .5 ms after the end of sleep; a restart must not be requested earlier
(7.3.1.1)."""

US_STEPS = 4


class PulseClock(NamedTuple):
    """The clock of a board's pulses: its oscillator and prescaler."""

    oscillator_hz: float
    prescale: int

    @classmethod
    def of_frequency(cls, frequency_hz: float, oscillator_hz: float) -> "PulseClock":
        """Return the clock with the prescaler for a frequency of pulses."""
        prescale = round(oscillator_hz / (COUNTS * frequency_hz)) - 1
        return cls(oscillator_hz, max(LEAST_PRESCALE, prescale))

    @property
    def resolution_steps(self) -> float:
        """Return the length of one 4096th of the period, quarter microseconds."""
        return (self.prescale + 1) / self.oscillator_hz * 1e6 * US_STEPS

    def counts_within(self, steps: int, low_steps: int, high_steps: int) -> int:
        """Return the counts nearest to a pulse; if it is inside the limits, the counts are too."""
        grain = self.resolution_steps
        least, most = ceil(low_steps / grain), floor(high_steps / grain)
        counts = round(steps / grain)
        if not low_steps <= steps <= high_steps or least > most:
            return counts
        return min(max(counts, least), most)


def output_register(channel: int) -> int:
    """Return the first register of a channel."""
    return LED0 + BYTES * channel


def pulse_registers(counts: int) -> bytes:
    """Return the registers of a channel for a pulse; 0: none."""
    return bytes((0, 0, counts & 0xFF, counts >> 8)) if counts else bytes((0, 0, 0, FULL_OFF))


def counts_of(registers: bytes) -> int:
    """Return the counts of a channel's pulse from its registers; 0: none."""
    on_low, on_high, off_low, off_high = registers
    if off_high & FULL_OFF:
        return 0
    if on_high & FULL_OFF:
        return COUNTS
    return ((off_low | (off_high & 0x0F) << 8) - (on_low | (on_high & 0x0F) << 8)) % COUNTS


def are_plausible(first_six: bytes, outputs: bytes, prescale: int) -> bool:
    """Return whether registers can belong to a PCA9685: reserved bits are 0.

    Args:
        first_six: Registers MODE1 to ALLCALLADR.
        outputs: Registers of all channels.
        prescale: Prescaler.
    """
    low_bits = any(address & 1 for address in first_six[2:])
    high_bits = first_six[1] & 0xE0 or any(byte & 0xE0 for byte in outputs[1::2])
    return not low_bits and not high_bits and prescale >= LEAST_PRESCALE


def adjacent_runs(channels: Sequence[int]) -> list[list[int]]:
    """Split ascending channels into runs of adjacent ones that fit into a bridge's buffer."""
    longest = CHANNELS - 1
    parted: list[list[int]] = []
    for channel in channels:
        if parted and parted[-1][-1] == channel - 1 and len(parted[-1]) < longest:
            parted[-1].append(channel)
        else:
            parted.append([channel])
    return parted

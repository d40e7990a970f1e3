"""The clock of a PCA9685, from what a person measures of the pulses that it makes.

Its oscillator has 25 MHz by the data sheet; boards of between 23 and 27 MHz are reported. Every
pulse is off by the same share.
"""

import re

from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.pca9685.registers import CHANNELS, COUNTS, PulseClock
from gazerig.drivers.types import ServoConfig

PULSE_STEPS = 1500 * US_STEPS
LOW_HZ, HIGH_HZ = 22e6, 28e6
"""No board has been seen outside; bounds of oscillator_hz, too."""

_MEASURED = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(hz|us)\s*", re.IGNORECASE)


def free_channel(params: Pca9685Params, address: int, used: frozenset[int]) -> int | None:
    """Return the last id of a board on which there is no joint, None where all have one."""
    first = CHANNELS * params.addresses.index(address)
    free = [one for one in range(first, first + CHANNELS) if one not in used]
    return free[-1] if free else None


def free_pulse(channel: int) -> ServoConfig:
    """Return the setup of a channel that gives 1500 us, with no servo on it."""
    return ServoConfig(
        channel, "hobby", PULSE_STEPS, PULSE_STEPS, 1.0, "no joint", rest_steps=PULSE_STEPS
    )


def oscillator_hz(clock: PulseClock, typed: str) -> float:
    """Return the frequency of an oscillator, whole kilohertz.

    Args:
        clock: what it was taken for while the pulses of 1500 us were measured.
        typed: "50.9 Hz" or "1473 us", as the meter shows.

    Raises:
        ValueError: these are no such words, or no PCA9685 could give that.
    """
    found = _MEASURED.fullmatch(typed)
    if found is None:
        raise ValueError(f"{typed!r}: type the frequency or the pulse, such as 50.9 Hz or 1473 us")
    value, unit = float(found[1]), found[2].lower()
    periods = clock.prescale + 1
    if unit == "hz":
        hz = value * COUNTS * periods
    else:
        counts = round(PULSE_STEPS / clock.grain_steps)
        hz = counts * periods * 1e6 / value if value else 0.0
    if not LOW_HZ <= hz <= HIGH_HZ:
        usual = clock.oscillator_hz / COUNTS / periods
        raise ValueError(
            f"{typed.strip()} would be a clock of {hz / 1e6:.2f} MHz, and there is none below "
            f"{LOW_HZ / 1e6:g} or above {HIGH_HZ / 1e6:g}: about {usual:.1f} Hz or 1500 us is to "
            "be expected; measure again"
        )
    return round(hz, -3)

"""Settings to make in a Maestro by Pololu's program, as no serial command can set them. Pure.

After an error, such as one damaged byte, a board moves every channel according to its setting. Off
stops the pulses, until the servos are held again at their positions. Ignore would continue, but
also after the program dies; Go to moves all servos home.

Source: Pololu Maestro User's Guide (0J40), sections 4.b (channel settings; Min and Max are
kept in multiples of 16 us) and 4.e (serial settings).
"""

from collections.abc import Iterator, Sequence
from math import ceil, floor

from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.maestro.board import MaestroParams, accel_units, speed_units
from gazerig.drivers.types import ServoConfig

FACTORY_US = (992, 2000)
"""Range of every channel of a new board."""

UNIT_US = 16
MANTISSA, MOST_DOUBLED = 31, 7
"""A board stores a speed as a number up to 31, doubled up to seven times."""

TIMEOUT_S = 0.5
"""Long compared with a tick, short compared with the time in which a hand can get between lids."""


def range_us(setup: ServoConfig) -> tuple[int, int]:
    """Return Min and Max of a channel, us: the joint's range rounded outwards."""
    step = UNIT_US * US_STEPS
    return (UNIT_US * floor(setup.min_steps / step), UNIT_US * ceil(setup.max_steps / step))


def wide_range(setup: ServoConfig) -> tuple[int, int] | None:
    """Return Min and Max of a channel if a new board's would cut the joint's range."""
    low, high = range_us(setup)
    if setup.min_steps >= FACTORY_US[0] * US_STEPS and setup.max_steps <= FACTORY_US[1] * US_STEPS:
        return None
    return low, high


def start_limits(setup: ServoConfig) -> tuple[int, int]:
    """Return Speed and Acceleration of a channel, which the board applies from its start on.

    In the board's units (0.25 us in 10 ms; that in 80 ms), 0 for unlimited. A board stores five
    bits of a speed and the number of doublings; it shows the stored value.
    """
    speed, doubled = speed_units(setup.max_speed_steps_s), 0
    while speed >> doubled > MANTISSA:
        doubled += 1
    if doubled > MOST_DOUBLED:
        return 0, accel_units(setup.max_accel_steps_s2)
    return (speed >> doubled) << doubled, accel_units(setup.max_accel_steps_s2)


def instructions(params: MaestroParams, setups: Sequence[ServoConfig]) -> Iterator[str]:
    """Return the settings to make in Pololu's Maestro Control Center, line by line."""
    yield "nothing of this can be set over the serial line; in Pololu's Maestro Control Center:"
    crc = "on" if params.crc else "off"
    yield "  tab Serial Settings:"
    yield f"    Serial mode: USB Dual Port    Enable CRC: {crc}"
    yield (
        f"    Timeout: {TIMEOUT_S:.2f} s, so that pulses stop when the program or the cable dies"
    )
    yield "  tab Channel Settings (Rate 50 Hz), of every channel: Mode Servo, 'On startup or"
    yield "    error' Off; its range, which cuts goals silently; limits for after a restart:"
    for setup in setups:
        low, high = range_us(setup)
        speed, accel = start_limits(setup)
        yield (
            f"    channel {setup.id:2}: Min {low:4}, Max {high:4}, Speed {speed:4}, "
            f"Acceleration {accel:3}    {setup.name}"
        )
    yield "  tab Script: no script, 'Run script on startup' off. Then Apply Settings, and close it."

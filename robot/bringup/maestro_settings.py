"""What must be set on a Maestro in Pololu's program, as no serial command can set it. Pure.

Source: Pololu Maestro User's Guide (0J40), sections 4.b (channel settings; Min and Max are
kept in multiples of 16 us) and 4.e (serial settings).
"""

from collections.abc import Iterator, Sequence
from math import ceil, floor

from drivers.bus_journal import call
from drivers.maestro.params import US_STEPS, MaestroParams
from drivers.types import ServoSetup

FACTORY_US = (992, 2000)
"""Range of every channel of a new board."""

UNIT_US = 16
TIMEOUT_S = 0.5
"""Long beside a tick, short beside what a hand between lids needs."""


def range_us(setup: ServoSetup) -> tuple[int, int]:
    """Give Min and Max of a channel, us: the joint's range rounded outwards."""
    step = UNIT_US * US_STEPS
    return (
        UNIT_US * floor(setup.min_steps / step),
        UNIT_US * ceil(setup.max_steps / step),
    )


def wide_range(setup: ServoSetup) -> tuple[int, int] | None:
    """Give Min and Max of a channel where a new board's would cut the joint's range."""
    low, high = range_us(setup)
    if setup.min_steps >= FACTORY_US[0] * US_STEPS and setup.max_steps <= FACTORY_US[1] * US_STEPS:
        return None
    return low, high


def instructions(params: MaestroParams, setups: Sequence[ServoSetup], usb: bool) -> Iterator[str]:
    """Say line by line what to set in Pololu's Maestro Control Center.

    usb: the board's own USB port is used; else its serial pins
    """
    yield "nothing of this can be set over the serial line; in Pololu's Maestro Control Center:"
    crc = "on" if params.crc else "off"
    mode = "USB Dual Port" if usb else f"UART, fixed baud rate {params.baud}"
    yield "  tab Serial Settings:"
    yield f"    Serial mode: {mode}    Device Number: {params.device}    Enable CRC: {crc}"
    yield (
        f"    Timeout: {TIMEOUT_S:.2f} s, so that servos go limp when the program or the cable dies"
    )
    yield "  tab Channel Settings (Rate 50 Hz), of every channel: Mode Servo, Speed 0,"
    yield "    Acceleration 0, 'On startup or error' Off; and its range, which cuts goals silently:"
    for setup in setups:
        low, high = range_us(setup)
        yield f"    channel {setup.id:2}: Min {low:4}, Max {high:4}    {setup.name}"
    yield "  tab Script: no script, 'Run script on startup' off. Then Apply Settings, and close it."


def clipped(setup: ServoSetup, asked_steps: float, got_steps: float) -> str:
    """Say that a board does not go where it was sent, and the cure."""
    low, high = range_us(setup)
    if not got_steps:
        return (
            f"{call(setup)} gives no pulses: set its channel to Servo in Pololu's program; "
            "gazerig doctor names errors of the board"
        )
    sent, got = f"{asked_steps / US_STEPS:g} us", f"{got_steps / US_STEPS:g} us"
    return (
        f"{call(setup)} is sent to {sent} and the board stays at {got}: set its Min to "
        f"{low} and its Max to {high} in Pololu's program"
    )

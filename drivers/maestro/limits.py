"""Speed and acceleration limits of a Maestro, in its own units.

Source: Pololu Maestro User's Guide (0J40), section 5.e.
"""

from math import ceil

from gazerig.drivers.maestro.commands import MOST

SPEED_STEPS_S = 100.0
"""Unit of the board's speed limit: a quarter microsecond in 10 ms."""

ACCEL_STEPS_S2 = SPEED_STEPS_S / 0.08
"""Unit of its acceleration limit: that change of speed in 80 ms."""

MOST_ACCEL = 255


def speed_units(steps_s: float) -> int:
    """Return the smallest speed limit that is not below a speed; 0 (unlimited) if there is none.

    Raises:
        ValueError: it is not a positive number.
    """
    return _units(steps_s / SPEED_STEPS_S, MOST, "speed")


def accel_units(steps_s2: float | None) -> int:
    """Return the smallest limit that is not below an acceleration; 0 (unlimited) if there is none.

    Raises:
        ValueError: it is not a positive number.
    """
    return 0 if steps_s2 is None else _units(steps_s2 / ACCEL_STEPS_S2, MOST_ACCEL, "acceleration")


def _units(wanted: float, most: int, what: str) -> int:
    if not wanted > 0.0:
        raise ValueError(f"a {what} limit must be above 0, not {wanted}")
    # A hair more than whole units is whole units that were divided and multiplied.
    return 0 if wanted > most else max(1, ceil(wanted - 1e-9))

"""Noise of the readings of a servo that holds its position."""

from functools import lru_cache

LENGTH = 4096
"""Period in milliseconds; a power of 2."""
SEED_APART_MS = 1009
"""Offset in time between servos of consecutive seeds."""


@lru_cache(maxsize=8)
def noise_table(current: int, velocity: int) -> tuple[tuple[int, int], ...]:
    """Return the noise of current and velocity for each of ``LENGTH`` milliseconds.

    It depends on the time only, so that reading does not change it; velocity is mostly 0.
    """
    return tuple(_noise(now_ms, current, velocity) for now_ms in range(LENGTH))


def _noise(now_ms: int, current: int, velocity: int) -> tuple[int, int]:
    mixed = (now_ms * 0x9E3779B1) & 0xFFFFFFFF
    mixed = ((mixed ^ mixed >> 15) * 0x85EBCA6B) & 0xFFFFFFFF
    mixed ^= mixed >> 13
    amps = mixed % (2 * current + 1) - current
    if mixed >> 24 & 3:
        return amps, 0
    return amps, (mixed >> 8) % (2 * velocity + 1) - velocity

"""Long times without a packet, of which only the start and the end are simulated."""

PAUSE_MS = 10_000
"""Longest time without a packet that is simulated millisecond by millisecond."""
_BEFORE_MS, _AFTER_MS = 3_000, 1_000
"""Simulated start and end of a pause: motions end in the first, readings vary in the second."""


def long_pause(now_ms: int, until_ms: int, unit_ms: int) -> tuple[int, int]:
    """Return start and length of the skipped part of a pause; (until, 0) for short pauses.

    unit_ms: the skipped time is a multiple of it.
    """
    if until_ms - now_ms <= PAUSE_MS:
        return until_ms, 0
    between_ms = until_ms - now_ms - _BEFORE_MS - _AFTER_MS
    return now_ms + _BEFORE_MS, between_ms // unit_ms * unit_ms

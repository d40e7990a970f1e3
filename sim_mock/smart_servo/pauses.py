"""Long times without a packet, of which a servo lives only the begin and the end."""

PAUSE_MS = 10_000
"""A time without any packet that is longer is not lived through millisecond by millisecond."""
_BEFORE_MS, _AFTER_MS = 3_000, 1_000
"""Of such a pause these are: whatever was begun ends, and what is asked then is in motion."""


def long_pause(now_ms: int, until_ms: int, unit_ms: int) -> tuple[int, int]:
    """Return start and length of the part of a pause that is skipped; (until, 0) for short pauses.

    unit_ms: The time passed at once is a whole number of these.
    """
    if until_ms - now_ms <= PAUSE_MS:
        return until_ms, 0
    between_ms = until_ms - now_ms - _BEFORE_MS - _AFTER_MS
    return now_ms + _BEFORE_MS, between_ms // unit_ms * unit_ms

"""Excess of messages on one connection: those beyond a rate are refused, then it is closed."""

import re

EXCESS_S, MOST_EXCESS = 1.0, 200
"""A connection is closed if more messages than this are refused as too many in this time."""
MOST_AT_ONCE = 100_000
"""It is closed at once after this many, as their refusals would occupy too much memory."""
REST_S = 0.5
"""Time in which stops are still received before such a connection is closed, s."""
TOO_MANY = "too many requests"
"""Prefix of the refusals of a client that sends too much."""
CLOSED = f"{TOO_MANY}: more than {MOST_EXCESS} refused in {EXCESS_S:g} s; this connection closes"
STOPPED = "it has been stopped meanwhile"
"""Refusal of a command that still waits when a stop of the same client arrives."""

_STOP = re.compile(rb'"stop"|\\u00(?:7[034]|6[fF])')


def find_stop(data: bytes) -> int:
    """Return where a message may name a stop, also with escaped letters, -1 if nowhere."""
    found = _STOP.search(data)
    return found.start() if found else -1


class ExcessCount:
    """Count of the messages that were refused because there were too many.

    Attributes:
        is_over: whether the connection should be closed.
    """

    def __init__(self) -> None:
        self.is_over = False
        self._began_s, self._count = 0.0, 0

    def add(self, late: int, now_s: float) -> None:
        """Add a number of messages that were too many, 0 for one that was not."""
        if late:
            self._began_s = self._began_s if self._count else now_s
            self._count += late
            self.is_over = self.is_over or self._count > MOST_AT_ONCE
        if self._count and now_s - self._began_s >= EXCESS_S:
            self.is_over = self.is_over or self._count > MOST_EXCESS
            self._count = 0

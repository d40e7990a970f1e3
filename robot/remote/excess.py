"""Excess of messages on one connection: those beyond a rate are refused, then it is closed."""

EXCESS_S, MOST_EXCESS = 1.0, 200
"""A connection is closed if more messages than this are refused as too many in this time."""
REST_S = 0.5
"""Time in which stops are still received before such a connection is closed, s."""
TOO_MANY = "too many requests"
"""Prefix of the refusals of a client that sends too much."""
CLOSED = f"{TOO_MANY}: more than {MOST_EXCESS} refused in {EXCESS_S:g} s; this connection closes"
STOPPED = "it has been stopped meanwhile"
"""Refusal of a command that still waits when a stop of the same client arrives."""


class ExcessCount:
    """Count of the messages that were refused because there were too many.

    Attributes:
        is_over: whether the connection should be closed.
    """

    def __init__(self) -> None:
        self.is_over = False
        self._began_s, self._count = 0.0, 0

    def add(self, late: bool, now_s: float) -> None:
        """Count a message; late: whether it was one too many."""
        if late:
            self._began_s = self._began_s if self._count else now_s
            self._count += 1
        if self._count and now_s - self._began_s >= EXCESS_S:
            self.is_over = self.is_over or self._count > MOST_EXCESS
            self._count = 0

"""Rates of messages: those beyond a rate are refused, then the connection is closed."""

import re
import threading

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


class TokenBucket:
    """Token bucket with a rate per second and a burst; thread-safe."""

    def __init__(self, per_s: float, burst: float) -> None:
        self._per_s, self._burst = per_s, burst
        self._left, self._at_s = burst, -1.0
        self._lock = threading.Lock()

    def take(self, now_s: float, amount: float = 1.0) -> bool:
        """Take tokens; return whether any token was left before."""
        if self.wait_s(now_s) > 0.0:
            return False
        self.spend(amount)
        return True

    def spend(self, amount: float) -> None:
        """Take tokens even if none is left."""
        with self._lock:
            self._left -= amount

    def wait_s(self, now_s: float) -> float:
        """Return the time until a token is available, s."""
        with self._lock:
            if self._at_s >= 0.0:
                gained = max(0.0, now_s - self._at_s) * self._per_s
                self._left = min(self._burst, self._left + gained)
            self._at_s = now_s
            return 0.0 if self._left > 0.0 else (1e-9 - self._left) / self._per_s


def is_stop(message: object) -> bool:
    """Return whether a message is a stop, which nothing may delay."""
    return isinstance(message, dict) and message.get("do") == "stop"

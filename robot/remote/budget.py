"""Limit on the processor time that other programs take from the control loop's interpreter.

Token buckets whose tokens are seconds of processor time: one for each connection, and one for
all together. Safe to call from any thread.
"""

import threading
from typing import NamedTuple


class RequestRate(NamedTuple):
    """Share of one processor, and the largest burst, s."""

    share: float
    burst_s: float


EACH = RequestRate(0.06, 0.2)
ALL = RequestRate(0.1, 0.4)


class Budget:
    """Token bucket of processor time.

    Args:
        rate: Share and size of the bucket.
        now_s: Time of the start, at which it is full, s.
    """

    def __init__(self, rate: RequestRate, now_s: float) -> None:
        self._rate = rate
        self._left_s = rate.burst_s
        self._at_s = now_s
        self._lock = threading.Lock()

    def spend(self, used_s: float, now_s: float) -> None:
        """Deduct processor time that was used, even if none is left."""
        with self._lock:
            self._fill(now_s)
            self._left_s -= used_s

    def wait_s(self, now_s: float) -> float:
        """Return the time until the bucket is no longer empty, s."""
        with self._lock:
            self._fill(now_s)
            return max(0.0, -self._left_s / self._rate.share)

    def _fill(self, now_s: float) -> None:
        gained = self._rate.share * max(0.0, now_s - self._at_s)
        self._left_s = min(self._rate.burst_s, self._left_s + gained)
        self._at_s = now_s

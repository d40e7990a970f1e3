"""How much processor time other programs may take from the control loop's interpreter.

Token buckets whose tokens are seconds of processor time: one for each connection, and one for
all together. Numbers in, numbers out; safe to call from any thread.
"""

import threading
from typing import NamedTuple


class RequestRate(NamedTuple):
    """A share of one processor, and the seconds that may be used at once."""

    share: float
    burst_s: float


EACH = RequestRate(0.06, 0.2)
ALL = RequestRate(0.1, 0.4)


class Budget:
    """One bucket of processor time.

    Args:
        rate: how fast it fills, and how much it holds.
        now_s: the time it begins at, full.
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
        """Return how long to wait until there is something left again."""
        with self._lock:
            self._fill(now_s)
            return max(0.0, -self._left_s / self._rate.share)

    def _fill(self, now_s: float) -> None:
        gained = self._rate.share * max(0.0, now_s - self._at_s)
        self._left_s = min(self._rate.burst_s, self._left_s + gained)
        self._at_s = now_s

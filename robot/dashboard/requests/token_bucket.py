"""How often something may be done: a token bucket."""


class TokenBucket:
    """So many a second, and so many at once after a pause."""

    def __init__(self, per_s: float, burst: float) -> None:
        self._per_s, self._burst = per_s, burst
        self._left, self._at_s = burst, -1.0

    def take(self, now_s: float, amount: float = 1.0) -> bool:
        """Return whether it may be done now, and count it if so."""
        if self.wait_s(now_s) > 0.0:
            return False
        self._left -= amount
        return True

    def wait_s(self, now_s: float) -> float:
        """Return how long to wait until something may be done, 0 for now, in seconds."""
        if self._at_s >= 0.0:
            gained = max(0.0, now_s - self._at_s) * self._per_s
            self._left = min(self._burst, self._left + gained)
        self._at_s = now_s
        return 0.0 if self._left > 0.0 else (1e-9 - self._left) / self._per_s

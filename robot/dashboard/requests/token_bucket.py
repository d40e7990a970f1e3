"""Rate limit by a token bucket."""


class TokenBucket:
    """Token bucket with a rate per second and a burst."""

    def __init__(self, per_s: float, burst: float) -> None:
        self._per_s, self._burst = per_s, burst
        self._left, self._at_s = burst, -1.0

    def take(self, now_s: float, amount: float = 1.0) -> bool:
        """Take tokens; return whether any were left before."""
        if self.wait_s(now_s) > 0.0:
            return False
        self._left -= amount
        return True

    def wait_s(self, now_s: float) -> float:
        """Return the time until there is a token, s."""
        if self._at_s >= 0.0:
            gained = max(0.0, now_s - self._at_s) * self._per_s
            self._left = min(self._burst, self._left + gained)
        self._at_s = now_s
        return 0.0 if self._left > 0.0 else (1e-9 - self._left) / self._per_s

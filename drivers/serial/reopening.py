"""When to try again to open a port that went away. Numbers in, numbers out."""

FIRST_S, LAST_S = 0.1, 1.0
"""Time between attempts: doubled from the first to the last."""


class Reconnect:
    """The state of a port: there, or gone since when and to be tried when.

    down: the port is gone
    """

    def __init__(self) -> None:
        self.down = False
        self._since_s = self._next_s = 0.0
        self._wait_s = FIRST_S

    def lost(self, now_s: float) -> None:
        """Note that the port went away."""
        self.down = True
        self._since_s, self._wait_s = now_s, FIRST_S
        self._next_s = now_s + FIRST_S

    def due(self, now_s: float) -> bool:
        """Return whether to try now."""
        return now_s >= self._next_s

    def failed(self, now_s: float, longest_s: float = LAST_S) -> None:
        """Note an attempt in vain; the next one comes within ``longest_s``."""
        self._wait_s = min(longest_s, 2.0 * self._wait_s)
        self._next_s = now_s + self._wait_s

    def back(self, now_s: float) -> float:
        """Note that the port is open again; gives for how long it had been gone."""
        self.down = False
        return now_s - self._since_s

    def gone_for_s(self, now_s: float) -> float:
        """Return for how long the port has been gone."""
        return now_s - self._since_s if self.down else 0.0

"""Is it this computer that is late, or the bus? Pure.

A busy computer looks like bad plugs: answers arrive after waiting for them has ended, and
servos whose own watchdog was not fed stop. Answers that do arrive, whole and late, tell it
from a servo that is silent.
"""

from collections import deque

WITHIN_S = 1.0
"""Answers late within such a time are counted."""

BUSY = 3
"""So many late answers within that time are no accident."""


class HostLateness:
    """Counts the answers that came after waiting for them had ended."""

    def __init__(self) -> None:
        self._late: deque[float] = deque(maxlen=1000)

    def late_answer(self, at_s: float) -> None:
        """Record that an answer has come late."""
        self._late.append(at_s)

    def forget(self) -> None:
        """Begin to count anew."""
        self._late.clear()

    def busy(self, now_s: float) -> int:
        """Return how many answers came late within the last second; 0 where they are few."""
        late = self._late
        while late and late[0] < now_s - WITHIN_S:
            late.popleft()
        return len(late) if len(late) >= BUSY else 0

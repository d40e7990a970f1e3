"""Events of a bus as text."""

from collections import deque
from math import inf

MOST = 200
"""Largest number of lines kept; the oldest are dropped."""


class EventLog:
    """Events as lines of text, drained by the status line, the page and the recorder.

    lines: lines added since the last drain
    """

    def __init__(self) -> None:
        self.lines: deque[str] = deque(maxlen=MOST)

    def add(self, text: str) -> None:
        """Add a line."""
        self.lines.append(text)

    def drain(self) -> tuple[str, ...]:
        """Return the lines since the last call."""
        if not self.lines:
            return ()
        lines = tuple(self.lines)
        self.lines.clear()
        return lines


SELDOM_S = 10.0
"""Shortest time between two lines of one kind."""


class RateLimitedLog:
    """Logs a repeated event at most every ``SELDOM_S``, with the number of repeats."""

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._reported_s: dict[str, float] = {}
        self._since: dict[str, int] = {}

    def add(self, text: str, now_s: float, kind: str = "") -> None:
        """Add a line unless one of its kind is recent; the next line counts the omitted ones."""
        if now_s - self._reported_s.get(kind, -inf) < SELDOM_S:
            self._since[kind] = self._since.get(kind, 0) + 1
            return
        self._reported_s[kind] = now_s
        often = self._since.pop(kind, 0)
        times = "once more" if often == 1 else f"{often} more times"
        self._log.add(f"{text} ({times} since it was last reported)" if often else text)


def register_label(register: str) -> str:
    """Return a register's name as the manuals print it."""
    return register.replace("_", " ").title().replace("Pwm", "PWM").replace("Id", "ID")

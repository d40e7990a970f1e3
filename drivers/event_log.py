"""Events of a bus as text."""

from collections import deque

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
        lines = tuple(self.lines)
        self.lines.clear()
        return lines


def register_label(register: str) -> str:
    """Return a register's name as the manuals print it."""
    return register.replace("_", " ").title().replace("Pwm", "PWM")

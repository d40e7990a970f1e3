"""What has happened on the bus, as text, and how a servo is called in it."""

from collections import deque
from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the guardian, which names servos too, starts without numpy
    from gazerig.drivers.types import ServoConfig

MOST = 200
"""More than so many lines that nobody has asked for are not kept."""


class EventLog:
    """Lines to be drained by whoever shows or records them."""

    def __init__(self) -> None:
        self._lines: deque[str] = deque(maxlen=MOST)

    def add(self, text: str) -> None:
        """Add a line."""
        self._lines.append(text)

    def drain(self) -> tuple[str, ...]:
        """Return the lines since the last call."""
        if not self._lines:
            return ()
        lines = tuple(self._lines)
        self._lines.clear()
        return lines


SELDOM_S = 10.0
"""The same is not said again within such a time."""


class RateLimitedLog:
    """Adds what happens again and again once in a while, and how often it has happened since."""

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._said_s: dict[str, float] = {}
        self._since: dict[str, int] = {}

    def add(self, text: str, now_s: float, kind: str = "") -> None:
        """Add a line unless one of its kind was added of late; a later one tells how many."""
        if now_s - self._said_s.get(kind, -inf) < SELDOM_S:
            self._since[kind] = self._since.get(kind, 0) + 1
            return
        self._said_s[kind] = now_s
        often = self._since.pop(kind, 0)
        self._log.add(f"{text} ({often} more times since it was said last)" if often else text)


def servo_label(setup: "ServoConfig", noun: str = "servo") -> str:
    """Return how people know a servo: its joint and its id, or its id where it has no name."""
    return f"{setup.name} ({noun} {setup.id})" if setup.name else f"{noun} {setup.id}"


def register_label(register: str) -> str:
    """Return a register's name as the manuals print it."""
    return register.replace("_", " ").title().replace("Pwm", "PWM").replace("Id", "ID")

"""What has happened on the bus, in words, and how a servo is called in them."""

from collections import deque

from drivers.maestro.params import HOBBY
from drivers.types import ServoSetup

MOST = 200
"""More than so many lines that nobody has asked for are not kept."""


class Journal:
    """Lines to be taken by whoever shows or records them."""

    def __init__(self) -> None:
        self._lines: deque[str] = deque(maxlen=MOST)

    def say(self, text: str) -> None:
        """Add a line."""
        self._lines.append(text)

    def take(self) -> tuple[str, ...]:
        """Give the lines since the last call."""
        if not self._lines:
            return ()
        lines = tuple(self._lines)
        self._lines.clear()
        return lines


def call(setup: ServoSetup) -> str:
    """Name a servo for people: its joint and its id, or its channel where it is a hobby servo."""
    noun = "channel" if setup.model in HOBBY else "servo"
    return f"{setup.name} ({noun} {setup.id})" if setup.name else f"{noun} {setup.id}"


def title(register: str) -> str:
    """Give a register's name as the manuals print it."""
    return register.replace("_", " ").title().replace("Pwm", "PWM").replace("Id", "ID")

"""What has happened on the bus, in words, and how a servo is called in them."""

from collections import deque
from math import inf

from drivers.hobby_board.models import HOBBY
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


SELDOM_S = 10.0
"""The same is not said again within such a time."""


class Seldom:
    """Says what happens again and again once in a while, and how often it has happened since."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._said_s: dict[str, float] = {}
        self._since: dict[str, int] = {}

    def say(self, text: str, now_s: float, kind: str = "") -> None:
        """Add a line unless one of its kind was added of late; a later one tells how many."""
        if now_s - self._said_s.get(kind, -inf) < SELDOM_S:
            self._since[kind] = self._since.get(kind, 0) + 1
            return
        self._said_s[kind] = now_s
        often = self._since.pop(kind, 0)
        self._journal.say(f"{text} ({often} more times since it was said last)" if often else text)


def call(setup: ServoSetup) -> str:
    """Name a servo for people: its joint and its id, or its channel where it is a hobby servo."""
    noun = "channel" if setup.model in HOBBY else "servo"
    return f"{setup.name} ({noun} {setup.id})" if setup.name else f"{noun} {setup.id}"


def title(register: str) -> str:
    """Give a register's name as the manuals print it."""
    return register.replace("_", " ").title().replace("Pwm", "PWM").replace("Id", "ID")

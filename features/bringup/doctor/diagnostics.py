"""What an examination finds, as values: how bad, what, where, and what to do about it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

Level = Literal["ok", "note", "warn", "error"]
LEVELS: tuple[Level, ...] = ("ok", "note", "warn", "error")


BOARD = -1
"""In place of a servo's id: the board that servos hang on."""


class Fix(NamedTuple):
    """One register write that mends something and moves nothing.

    servo_id: ``BOARD`` for the board itself, whose "registers" are what can be told to it
    was: the value found, None where it could not be read
    """

    servo_id: int
    register: str
    value: int
    was: int | None = None

    def __str__(self) -> str:
        """Write ``return delay time 250 -> 0``."""
        was = "?" if self.was is None else self.was
        return f"{self.register.replace('_', ' ')} {was} -> {self.value}"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing found.

    level: ok, note (worth knowing), warn (works, but not well), error (does not work)
    what: the fact; where: port, joint or file; remedy: what to do, "" where nothing is needed
    fixes: what ``--fix`` may do about it
    """

    level: Level
    what: str
    where: str
    remedy: str = ""
    fixes: tuple[Fix, ...] = ()

    def __str__(self) -> str:
        """Write it on one line."""
        return f"{self.level}: {self.where}: {self.what}{f': {self.remedy}' if self.remedy else ''}"


def worst(findings: Iterable[Diagnostic]) -> Level:
    """Return the worst level there is, "ok" where nothing was found."""
    return max((finding.level for finding in findings), key=LEVELS.index, default="ok")

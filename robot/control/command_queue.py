"""Commands on their way from any thread to the tick: bounded, and a stop before all else."""

from collections import deque
from contextlib import suppress
from typing import NamedTuple

from gazerig.robot.model.commands import Command, Leading, Resume, SetLevel, Stop, Tune
from gazerig.robot.model.reply import CommandReply, Ticket

MAX_WAITING = 64
MAX_PER_TICK = 8
"""Commands executed in one tick, stops not counted; among them one change of parameters at most,
as that takes longest."""


class QueuedCommand(NamedTuple):
    """A command, and where its reply goes."""

    command: Command
    ticket: Ticket


class CommandQueue:
    """The commands that have come since the last tick."""

    def __init__(self) -> None:
        self._commands: deque[QueuedCommand] = deque()
        self._stops: deque[QueuedCommand] = deque()

    def __bool__(self) -> bool:
        """Return whether any command waits."""
        return bool(self._commands or self._stops)

    def __len__(self) -> int:
        """Return how many commands wait."""
        return len(self._commands) + len(self._stops)

    def add(self, command: Command) -> Ticket:
        """Queue a command; may be called from any thread.

        Raises:
            ValueError: too many wait already. A stop is never refused.
        """
        waiting = QueuedCommand(command, Ticket())
        if isinstance(command, Stop):
            if len(self._stops) >= MAX_WAITING:
                with suppress(IndexError):  # taken up in this moment
                    return self._stops[-1].ticket  # as good as one more
            self._stops.append(waiting)
            return waiting.ticket
        if len(self._commands) >= MAX_WAITING:
            raise ValueError(f"too many requests: {MAX_WAITING} commands wait already, ask again")
        self._commands.append(waiting)
        return waiting.ticket

    def stops(self) -> list[QueuedCommand]:
        """Remove and return all stops, and refuse with them commands that would move the head."""
        taken: list[QueuedCommand] = []
        while self._stops:
            taken.append(self._stops.popleft())
        if taken:
            self._drop_leads()
        return taken

    def take(self) -> list[QueuedCommand]:
        """Return and remove the commands of this tick, stops first."""
        taken = self.stops()
        tunes, most = 0, len(taken) + MAX_PER_TICK
        while self._commands and len(taken) < most:
            tunes += isinstance(self._commands[0].command, Tune)
            if tunes > 1:
                break
            taken.append(self._commands.popleft())
        return _without_superseded(taken)

    def _drop_leads(self) -> None:
        """Refuse what was asked for before a stop and would move the head; keep the rest."""
        for _ in range(len(self._commands)):
            waiting = self._commands.popleft()
            if isinstance(waiting.command, Leading | Resume):
                waiting.ticket.answer(CommandReply("it has been stopped since"))
            else:
                self._commands.append(waiting)


def _without_superseded(taken: list[QueuedCommand]) -> list[QueuedCommand]:
    """Return the commands without levels that a later one of this tick sets again."""
    kept: list[QueuedCommand] = []
    seen: set[str] = set()
    for waiting in reversed(taken):
        if isinstance(waiting.command, SetLevel):
            if waiting.command.level in seen:
                waiting.ticket.answer(CommandReply())
                continue
            seen.add(waiting.command.level)
        kept.append(waiting)
    return kept[::-1]

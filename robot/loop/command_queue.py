"""Bounded queue of commands from any thread to the tick; stops come first."""

from collections import deque
from contextlib import suppress
from typing import NamedTuple

from msgspec import structs

from gazerig.robot.model.commands import Command, ControlCommand, Resume, SetLevel, Stop, Tune
from gazerig.robot.model.reply import CommandReply, Ticket

MAX_WAITING = 64
MAX_PER_TICK = 8
"""Commands executed in one tick, without stops. At most one of them changes parameters, as that
takes longest."""


class QueuedCommand(NamedTuple):
    """A command and the ticket of its reply."""

    command: Command
    ticket: Ticket


class CommandQueue:
    """The commands since the last tick."""

    def __init__(self) -> None:
        self._commands: deque[QueuedCommand] = deque()
        self._stops: deque[QueuedCommand] = deque()
        self._replies: list[tuple[Ticket, CommandReply]] = []

    def __bool__(self) -> bool:
        """Return whether any command is queued."""
        return bool(self._commands or self._stops)

    def __len__(self) -> int:
        """Return the number of queued commands."""
        return len(self._commands) + len(self._stops)

    def add(self, command: Command) -> Ticket:
        """Queue a command. Thread-safe.

        Raises:
            ValueError: The queue is full. A stop is never refused.
        """
        waiting = QueuedCommand(command, Ticket())
        if isinstance(command, Stop):
            if len(self._stops) >= MAX_WAITING:
                with suppress(IndexError):  # the loop has just taken it
                    return self._stops[-1].ticket  # same effect as another stop
            self._stops.append(waiting)
            return waiting.ticket
        if len(self._commands) >= MAX_WAITING:
            raise ValueError(f"too many requests: {MAX_WAITING} commands are waiting, try again")
        self._commands.append(waiting)
        return waiting.ticket

    def reply(self, waiting: QueuedCommand, reply: CommandReply) -> None:
        """Store the reply to a command until ``give_replies``."""
        self._replies.append((waiting.ticket, reply))

    def give_replies(self, t_s: float) -> None:
        """Give the replies; called when others can see the tick of t_s, which executed them."""
        replies, self._replies = self._replies, []
        for ticket, reply in replies:
            ticket.answer(structs.replace(reply, t_s=t_s))

    def take_stops(self) -> list[QueuedCommand]:
        """Remove and return all stops; refuse queued commands that would move the head."""
        taken: list[QueuedCommand] = []
        while self._stops:
            taken.append(self._stops.popleft())
        if taken:
            self._refuse_motions()
        return taken

    def take(self) -> list[QueuedCommand]:
        """Remove and return the commands of this tick, stops first."""
        taken = self.take_stops()
        tunes, most = 0, len(taken) + MAX_PER_TICK
        while self._commands and len(taken) < most:
            tunes += isinstance(self._commands[0].command, Tune)
            if tunes > 1:
                break
            taken.append(self._commands.popleft())
        return self._drop_superseded(taken)

    def _refuse_motions(self) -> None:
        """Refuse commands before a stop that would move the head; keep the others."""
        for _ in range(len(self._commands)):
            waiting = self._commands.popleft()
            if isinstance(waiting.command, ControlCommand | Resume):
                self.reply(waiting, CommandReply("it has been stopped meanwhile"))
            else:
                self._commands.append(waiting)

    def _drop_superseded(self, taken: list[QueuedCommand]) -> list[QueuedCommand]:
        """Return the commands without levels that a later command of this tick sets again."""
        kept: list[QueuedCommand] = []
        seen: set[str] = set()
        for waiting in reversed(taken):
            if isinstance(waiting.command, SetLevel):
                if waiting.command.level in seen:
                    self.reply(waiting, CommandReply())
                    continue
                seen.add(waiting.command.level)
            kept.append(waiting)
        return kept[::-1]

"""Group of heads in one world: a stop of one head stops all."""

import contextlib
from collections.abc import Sequence
from typing import NamedTuple

from gazerig.robot.control.loop import Robot
from gazerig.robot.control.tick_text import head_activity
from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.model.commands import Command, Resume, Stop
from gazerig.robot.model.reply import CommandReply, Ticket
from gazerig.robot.model.types import OtherHead


class NamedRobot(NamedTuple):
    """Another head of the same world: its name and its robot."""

    name: str
    robot: Robot

    def describe(self) -> OtherHead:
        """Return a description of its present activity."""
        newest = self.robot.newest_tick
        if newest is None:
            return OtherHead(self.name, "has not started")
        return OtherHead(self.name, head_activity(newest).headline, newest.guard_result.level)


class RobotGroup:
    """A group of heads: stops and resumes apply to all, other commands to the first.

    Args:
        first: Head that receives the commands.
        others: The other heads.
    """

    def __init__(self, first: Robot, others: Sequence[NamedRobot]) -> None:
        self._first, self._others = first, tuple(others)

    def command(self, command: Command) -> Ticket | None:
        """Queue a command for the next tick, a stop or a resume for all heads.

        Returns:
            The ticket of the first head's reply; for a stop or a resume also of any refusal.

        Raises:
            ValueError: The command is invalid.
        """
        if not isinstance(command, Stop | Resume):
            return self._first.command(command)
        tickets: list[tuple[str, Ticket]] = []
        for name, robot in self._others:
            with contextlib.suppress(ValueError):  # nothing may prevent the others from stopping
                tickets.append((name, robot.command(command)))
        return _GroupTicket(self._first.command(command), tickets)

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return the first head's menus."""
        return self._first.menus()

    def tracks(self) -> tuple[TrackInfo, ...]:
        """Return the first head's tracks."""
        return self._first.tracks()


class _GroupTicket(Ticket):
    """The ticket of the first head's reply, or of another head's refusal."""

    def __init__(self, first: Ticket, others: Sequence[tuple[str, Ticket]]) -> None:
        self._first, self._others = first, tuple(others)

    def wait(self, within_s: float) -> CommandReply | None:
        """Wait up to ``within_s`` for each reply; return None if the first head has not replied."""
        reply = self._first.wait(within_s)
        if reply is None or reply.refused:
            return reply
        for name, ticket in self._others:
            # Each head counts a stop from its own ticks, so one may still refuse a resume.
            theirs = ticket.wait(within_s)
            if theirs is None:
                return CommandReply(f"head {name} does not answer")
            if theirs.refused:
                return CommandReply(f"head {name}: {theirs.refused}")
        return reply

"""Several heads of one world as those outside command them: what stops one stops all."""

import contextlib
from collections.abc import Sequence
from typing import NamedTuple

from gazerig.robot.control.gesture_choices import GestureInfo
from gazerig.robot.control.loop import Robot
from gazerig.robot.control.tick_text import doing
from gazerig.robot.model.commands import Command, Resume, Stop
from gazerig.robot.model.reply import CommandReply, Ticket
from gazerig.robot.model.types import OtherHead


class NamedRobot(NamedTuple):
    """Another head of the same world: its name there, and the robot that leads it."""

    name: str
    robot: Robot

    def seen(self) -> OtherHead:
        """Return what it does now, in words."""
        newest = self.robot.newest
        if newest is None:
            return OtherHead(self.name, "has not begun")
        return OtherHead(self.name, doing(newest).headline, newest.guard_result.level)


class HeadsTogether:
    """The first of several heads, with which all are stopped and resumed; all else it does alone.

    Args:
        first: what commands are for.
        others: the other heads.
    """

    def __init__(self, first: Robot, others: Sequence[NamedRobot]) -> None:
        self._first, self._others = first, tuple(others)

    def command(self, command: Command) -> Ticket | None:
        """Queue a command for the next tick, a stop and its end for all heads.

        Returns:
            Where the first head's reply comes; of a stop or its end, what any of them refuses.

        Raises:
            ValueError: it cannot be done.
        """
        if not isinstance(command, Stop | Resume):
            return self._first.command(command)
        tickets: list[tuple[str, Ticket]] = []
        for name, robot in self._others:
            with contextlib.suppress(ValueError):  # nothing may keep the others from stopping
                tickets.append((name, robot.command(command)))
        return _TicketOfAll(self._first.command(command), tickets)

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return what the first head offers."""
        return self._first.menus()

    def gestures(self) -> tuple[GestureInfo, ...]:
        """Return the first head's gestures."""
        return self._first.gestures()


class _TicketOfAll(Ticket):
    """The first head's reply, unless another head refuses what the first has done."""

    def __init__(self, first: Ticket, others: Sequence[tuple[str, Ticket]]) -> None:
        self._first, self._others = first, tuple(others)

    def wait(self, within_s: float) -> CommandReply | None:
        """Wait so long for the reply of each; None where the first head's loop has given none."""
        reply = self._first.wait(within_s)
        if reply is None or reply.refused:
            return reply
        for name, ticket in self._others:
            # Heads count a stop from ticks of their own: of two, one may still have to hold it.
            theirs = ticket.wait(within_s)
            if theirs is None:
                return CommandReply(f"head {name} does not answer")
            if theirs.refused:
                return CommandReply(f"head {name}: {theirs.refused}")
        return reply

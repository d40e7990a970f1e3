"""Commands for several heads: the refusal of one is reported, whatever the first has done."""

from typing import cast

import pytest

from gazerig.robot.control.loop import Robot
from gazerig.robot.control.robot_group import NamedRobot, RobotGroup
from gazerig.robot.model.commands import Command, Renew, Resume, Stop
from gazerig.robot.model.reply import CommandReply, Ticket


class Head:
    """A head that gives the same reply, None for none, to all commands."""

    def __init__(self, reply: CommandReply | None, full: bool = False) -> None:
        self._reply, self._full = reply, full
        self.told: list[Command] = []

    def command(self, command: Command) -> Ticket:
        if self._full:
            raise ValueError("too many commands wait")
        self.told.append(command)
        ticket = Ticket()
        if self._reply is not None:
            ticket.answer(self._reply)
        return ticket


DONE, HOLDS = CommandReply(), CommandReply("a stop lasts at least 2 s: try again in 0.1 s")


def together(first: Head, *others: Head) -> RobotGroup:
    named = [NamedRobot(f"head{n}", cast("Robot", one)) for n, one in enumerate(others, 2)]
    return RobotGroup(cast("Robot", first), named)


def reply(command: Command, first: Head, *others: Head) -> CommandReply | None:
    ticket = together(first, *others).command(command)
    assert ticket is not None
    return ticket.wait(0.01)


@pytest.mark.parametrize("command", [Stop("too near", "a test"), Resume("a test")])
def test_a_stop_and_its_end_are_for_all_heads(command: Command) -> None:
    heads = [Head(DONE) for _ in range(3)]
    assert reply(command, *heads) == DONE
    assert [head.told for head in heads] == [[command]] * 3


def test_everything_else_is_for_the_first() -> None:
    first, other = Head(DONE), Head(HOLDS)
    assert reply(Renew("a test"), first, other) == DONE
    assert len(first.told) == 1 and other.told == []


def test_a_head_that_stays_stopped_is_named() -> None:
    found = reply(Resume("a test"), Head(DONE), Head(DONE), Head(HOLDS))
    assert found is not None and found.refused == f"head head3: {HOLDS.refused}"


def test_a_head_that_does_not_answer_is_named() -> None:
    found = reply(Stop("too near", "a test"), Head(DONE), Head(None))
    assert found is not None and found.refused == "head head2 does not answer"


def test_the_first_heads_own_refusal_is_told_as_it_is() -> None:
    assert reply(Resume("a test"), Head(HOLDS), Head(DONE)) == HOLDS
    assert reply(Resume("a test"), Head(None), Head(DONE)) is None


def test_nothing_keeps_the_others_from_stopping() -> None:
    first, other = Head(DONE), Head(DONE)
    assert reply(Stop("too near", "a test"), first, Head(DONE, full=True), other) == DONE
    assert len(first.told) == len(other.told) == 1

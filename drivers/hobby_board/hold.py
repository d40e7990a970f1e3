"""Switching a channel's pulses on with as little motion as possible.

A channel that already outputs pulses is held there. Without pulses the servo's position is unknown,
and a first pulse is not ramped: the servo moves there at its own speed.
"""

from enum import Enum

from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import FINE_STEPS, Channel
from gazerig.drivers.hobby_board.models import US_STEPS


class HoldResult(Enum):
    """Result of enabling a channel: it is held, no answer, or another pulse."""

    HELD = "held"
    NO_ANSWER = "no answer"
    ELSEWHERE = "elsewhere"


def hold_channel(board: Board, channel: Channel, pulse_steps: int) -> HoldResult:
    """Hold a channel at its present pulse, or without one at its last position.

    Speed and acceleration are armed before the goal is sent, and the pulse is read afterwards. A
    joint outside its limits moves inside at 30 deg/s.

    Raises:
        BusLost: the port is lost.
    """
    goal = channel.start(pulse_steps, board.line.port.now_s())
    if not board.send_limits([channel], confirmed=True):
        return HoldResult.NO_ANSWER
    board.send_goals([channel])
    found = board.pulses((channel.id,))
    channel.advance(board.line.port.now_s())
    if found is None:
        return HoldResult.NO_ANSWER
    low, high = sorted((pulse_steps or goal, goal))
    # A first pulse is exact; another one may have been moving when it was read.
    room = channel.room_steps() if pulse_steps else FINE_STEPS
    if not found[0] or not low - room <= found[0] <= high + room:
        channel.gives(found[0])
        return HoldResult.ELSEWHERE
    channel.ramp.found(found[0])
    channel.hold()
    return HoldResult.HELD


def refusal(board: Board, channel: Channel) -> str:
    """Return why a channel's pulse differs from the commanded one, with the remedy."""
    goal, pulse = channel.goal_steps, round(channel.ramp.pulse_steps) if channel.on else 0
    if not pulse:
        return f"{channel.setup.label('channel')} has no pulses: {board.texts.no_pulses}"
    sent, got = f"{goal / US_STEPS:g} us", f"{pulse / US_STEPS:g} us"
    return (
        f"{channel.setup.label('channel')} is sent to {sent} and gets {got}: "
        f"{board.texts.other_pulse}"
    )

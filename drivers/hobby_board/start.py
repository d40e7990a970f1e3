"""Enabling a board's channels, with a message for every problem."""

from collections.abc import Sequence
from enum import Enum
from math import inf

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import FINE_STEPS, Channel
from gazerig.drivers.hobby_board.params import US_STEPS
from gazerig.drivers.hobby_board.release import TRIES
from gazerig.drivers.serial.port import wait_until
from gazerig.drivers.types import ServoConfig


class HoldResult(Enum):
    """Result of enabling a channel: it is held, no answer, or another pulse."""

    HELD = "held"
    NO_ANSWER = "no answer"
    OTHER_PULSE = "elsewhere"


def hold_channel(board: Board, channel: Channel, pulse_steps: int) -> HoldResult:
    """Hold a channel at its present pulse, or without one at its last position.

    A channel that already outputs pulses is held there. Without pulses the servo's position is
    unknown, and a first pulse is not ramped: the servo moves there at its own speed.

    Speed and acceleration are armed before the goal is sent, and the pulse is read afterwards. A
    joint outside its limits moves inside at 30 deg/s.

    Raises:
        BusLost: the port is lost.
    """
    goal = channel.start(pulse_steps, board.line.port.now_s())
    if not board.send_limits([channel], confirmed=True):
        return HoldResult.NO_ANSWER
    board.send_goals([channel])
    found = board.read_pulses((channel.id,))
    channel.advance(board.line.port.now_s())
    if found is None:
        return HoldResult.NO_ANSWER
    low, high = sorted((pulse_steps or goal, goal))
    # A first pulse is exact; another one may have been moving when it was read.
    room = channel.pulse_tolerance_steps() if pulse_steps else FINE_STEPS
    if not found[0] or not low - room <= found[0] <= high + room:
        channel.record_pulse(found[0])
        return HoldResult.OTHER_PULSE
    channel.ramp.set_pulse(found[0])
    channel.record_hold()
    return HoldResult.HELD


def refusal_text(board: Board, channel: Channel) -> str:
    """Return why a channel's pulse differs from the commanded one, with the remedy."""
    goal, pulse = channel.goal_steps, round(channel.ramp.pulse_steps) if channel.on else 0
    if not pulse:
        fault = f"{channel.setup.label('channel')} has no pulses"
        return _blame(board, fault, board.texts.no_pulses_remedy)
    sent, got = f"{goal / US_STEPS:g} us", f"{pulse / US_STEPS:g} us"
    return _blame(
        board,
        f"{channel.setup.label('channel')} is sent to {sent} and gets {got}",
        board.texts.other_pulse_remedy,
    )


def _blame(board: Board, fault: str, remedy: str) -> str:
    """Return a fault with its remedy, or with this computer as its cause if it was late."""
    return board.line.lateness.blame(fault, remedy, board.line.port.now_s())


def read_every_pulse(board: Board, setups: Sequence[ServoConfig]) -> tuple[int, ...]:
    """Read every pulse.

    Raises:
        BusLost: the port is lost.
        ServoMissing: a channel does not answer.
    """
    ids = tuple(setup.id for setup in setups)
    for _ in range(TRIES):
        pulses = board.read_pulses(ids)
        if pulses is not None:
            return pulses
    where = board.line.port.port_name
    for setup in setups:
        if board.read_pulses((setup.id,)) is None:
            fault = f"{where}: no answer about {setup.label('channel')}"
            raise ServoMissing(_blame(board, fault, board.texts.no_answer_remedy))
    raise ServoMissing(_blame(board, f"{where}: answers are lost", board.texts.noise_remedy))


def enable_channels(board: Board, channels: Sequence[Channel], log: EventLog) -> None:
    """Enable every channel; channels without pulses one after another.

    Raises:
        BusLost: the port is lost.
        ServoMissing: the board does not answer, or a channel does not accept its goal.
    """
    board.prepare(log)
    pulses = read_every_pulse(board, [channel.setup for channel in channels])
    for channel, pulse in zip(channels, pulses, strict=True):
        channel.adopt_pulse(pulse)
    without_pulses = [channel.setup.label("channel") for channel in channels if not channel.on]
    if without_pulses:
        log.add(f"{', '.join(without_pulses)} had no pulses: they move to their goals immediately")
    start_s = -inf
    for channel, pulse in zip(channels, pulses, strict=True):
        if not pulse:
            wait_until(board.line.port, start_s + board.timing.stagger_s)
            start_s = board.line.port.now_s()
        _enable_channel(board, channel, pulse)


def _enable_channel(board: Board, channel: Channel, pulse: int) -> None:
    """Enable one channel."""
    for _ in range(TRIES):
        outcome = hold_channel(board, channel, pulse)
        if outcome is HoldResult.HELD:
            return
        if outcome is HoldResult.OTHER_PULSE and channel.on:
            break
    where = board.line.port.port_name
    if outcome is HoldResult.NO_ANSWER:
        fault = f"{where}: no answer about {channel.setup.label('channel')}"
        raise ServoMissing(_blame(board, fault, "check its cable"))
    raise ServoMissing(f"{where}: {refusal_text(board, channel)}")

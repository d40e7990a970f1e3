"""Enabling a board's channels, with a message for every problem."""

from collections.abc import Sequence
from math import inf

from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.hold import HoldResult, hold_channel, refusal
from gazerig.drivers.hobby_board.release import TRIES
from gazerig.drivers.types import ServoConfig


def read_every_pulse(board: Board, setups: Sequence[ServoConfig]) -> tuple[int, ...]:
    """Read every pulse.

    Raises:
        BusLost: the port is lost.
        ServoMissing: a channel does not answer.
    """
    ids = tuple(setup.id for setup in setups)
    for _ in range(TRIES):
        pulses = board.pulses(ids)
        if pulses is not None:
            return pulses
    where = board.line.port.port_name
    for setup in setups:
        if board.pulses((setup.id,)) is None:
            raise ServoMissing(
                f"{where}: no answer about {setup.label('channel')}: {board.texts.no_answer}"
            )
    raise ServoMissing(f"{where}: answers are lost: {board.texts.noise}")


def enable_channels(board: Board, channels: Sequence[Channel], log: EventLog) -> None:
    """Enable every channel; channels without pulses one after another.

    Raises:
        BusLost: the port is lost.
        ServoMissing: the board does not answer, or a channel does not accept its goal.
    """
    board.prepare(log)
    pulses = read_every_pulse(board, [channel.setup for channel in channels])
    for channel, pulse in zip(channels, pulses, strict=True):
        channel.found(pulse)
    without_pulses = [channel.setup.label("channel") for channel in channels if not channel.on]
    if without_pulses:
        log.add(f"{', '.join(without_pulses)} had no pulses: they move to their goals immediately")
    start_s = -inf
    for channel, pulse in zip(channels, pulses, strict=True):
        if not pulse:
            board.wait(start_s + board.timing.stagger_s)
            start_s = board.line.port.now_s()
        _enable_channel(board, channel, pulse)


def _enable_channel(board: Board, channel: Channel, pulse: int) -> None:
    """Enable one channel.

    Raises:
        ServoMissing: it does not accept its goal.
    """
    for _ in range(TRIES):
        outcome = hold_channel(board, channel, pulse)
        if outcome is HoldResult.HELD:
            return
        if outcome is HoldResult.ELSEWHERE and channel.on:
            break
    where = board.line.port.port_name
    if outcome is HoldResult.NO_ANSWER:
        raise ServoMissing(
            f"{where}: no answer about {channel.setup.label('channel')}: check its cable"
        )
    raise ServoMissing(f"{where}: {refusal(board, channel)}")

"""Slow motion of one channel of a board, so that a person sees which servo moves.

A first pulse cannot be slowed down: a servo without pulses moves there immediately, at its own
speed. After that it moves slowly. The pulses end with the walk in all cases.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.release import switch_off
from gazerig.drivers.hobby_board.start import HoldResult, hold_channel, read_every_pulse
from gazerig.drivers.types import ServoConfig

SLOW_STEPS_S = 20.0 / 360.0 * 16_000.0
"""20 deg/s of the servo's shaft."""

SETTLE_S = 0.4
"""Time from the first pulse until a servo has arrived from any position."""

LOOK_S = 0.02
FINE_STEPS = 2
LATE_S = 1.0
MOST_TRIES = 10
"""Long, because answers are late on a busy computer, and time does not matter here."""


class ChannelPosition(NamedTuple):
    """Commanded position of a channel, and the board's pulse at the end, in steps."""

    commanded: int
    reported: int


def walk_channel(
    board: Board,
    setup: ServoConfig,
    places: Sequence[int],
    sleep_until: Callable[[float], None],
    speed_steps_s: float = SLOW_STEPS_S,
) -> tuple[ChannelPosition, ...]:
    """Move a channel to positions, the first immediately, the others slowly; then stop the pulses.

    Args:
        board: board with an open port.
        setup: the servo; positions outside its limits are skipped.
        places: positions in quarter microseconds.
        sleep_until: waits until a time of the port's clock.
        speed_steps_s: speed between the positions.

    Raises:
        ServoMissing: the board does not answer, or the channel is no servo's.
        ServoFault: the pulses do not end.
        BusLost: the port has disappeared.
    """
    slow = setup._replace(
        max_speed_steps_s=speed_steps_s, max_accel_steps_s2=None, rest_steps=places[0]
    )
    gone: list[ChannelPosition] = []
    now_s = board.line.port.now_s
    with start_pulses(board, slow) as channel:
        start = round(channel.ramp.pulse_steps)
        for nth, asked in enumerate(places):
            channel.record_goal(channel.clip(asked), now_s())
            board.send_goals([channel])
            takes_s = abs(asked - start) / speed_steps_s + SETTLE_S
            until_s = now_s() + takes_s + LATE_S
            start = _wait_for_channel(board, channel, sleep_until)
            while abs(start - asked) > FINE_STEPS and now_s() < until_s:
                start = _wait_for_channel(board, channel, sleep_until)
            gone.append(ChannelPosition(asked, start))
            until_s = now_s() + SETTLE_S
            # The board may have a timeout, so it is read in the meantime.
            while not nth and now_s() < until_s:
                _wait_for_channel(board, channel, sleep_until)
    return tuple(gone)


@contextmanager
def start_pulses(board: Board, setup: ServoConfig) -> Iterator[Channel]:
    """Send pulses on a channel: its present pulse, or its servo's rest pulse; off at the end.

    Raises:
        ServoMissing: the board does not answer, or the channel is no servo's.
        ServoFault: the pulses do not end.
        BusLost: the port has disappeared.
    """
    log = EventLog()
    (pulse,) = board.find([setup], log)
    board.prepare(log)
    channel = Channel(setup, board.timing.longest_ramp_s)
    try:
        outcomes = (hold_channel(board, channel, pulse) for _ in range(MOST_TRIES))
        if all(outcome is HoldResult.NO_ANSWER for outcome in outcomes):
            raise ServoMissing(
                f"{board.line.port.port_name}: no answer about {servo_label(setup)}: check its "
                "cable"
            )
        channel.record_hold()
        yield channel
    finally:
        try:
            left = switch_off(board, (setup.id,))
            sure = not left.holding_ids and not left.unconfirmed_ids
        except BusLost:
            sure = False
        if not sure:
            raise ServoFault(
                f"{servo_label(setup)} may still get pulses: switch the servo supply off"
            )


def _wait_for_channel(board: Board, channel: Channel, sleep_until: Callable[[float], None]) -> int:
    """Wait a moment and return the pulse; advance it if the board does not do so itself."""
    sleep_until(board.line.port.now_s() + LOOK_S)
    channel.advance(board.line.port.now_s())
    board.advance_pulses([channel])
    for _ in range(MOST_TRIES - 1):
        pulses = board.read_pulses((channel.id,))
        if pulses is not None:
            return pulses[0]
    return read_every_pulse(board, [channel.setup])[0]

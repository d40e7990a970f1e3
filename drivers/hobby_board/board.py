"""Interface of a board that sends pulses to hobby servos; one class per kind of board.

A board either ramps its pulses to their goals itself, within limits armed in it (Maestro), or
applies pulses immediately, and the driver ramps them (PCA9685): ``send_goals`` then sends
intermediate pulses.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from gazerig.drivers.bus.port_bus import Exchange
from gazerig.drivers.bus.timing import BusTiming
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.hobby_board.release import Stoppable
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig


class ChannelStatus(NamedTuple):
    """Status of a channel and of its board.

    pulse_steps: present pulse of the channel, quarter microseconds; 0: none
    errors: names of the board's errors since the last read
    """

    pulse_steps: int
    errors: tuple[str, ...] = ()


class Board(Stoppable, Exchange, Protocol):
    """One board, or several on one line; all methods may raise BusLost.

    port, lateness: its port, and the counter of late answers
    name: name for messages
    remedy: remedy if channels output other pulses than commanded
    longest_ramp_s: longest time for which the driver's ramps advance while nothing is sent; inf:
        the board itself ramps pulses
    """

    name: str
    remedy: str
    longest_ramp_s: float
    timing: BusTiming
    port: BusPort
    lateness: HostLateness

    def __init__(self, port: BusPort, params: Any, timing: BusTiming) -> None:
        """Use a port, which is not opened yet."""

    @property
    def params(self) -> HobbyBoardParams:
        """Return its parameters from the rig file."""

    def find(self, setups: Sequence[ServoConfig], log: EventLog) -> tuple[int, ...]:
        """Find the board and return the pulses of these servos; nothing moves.

        Raises:
            ServoMissing: it does not answer, or a channel is not a servo channel.
        """

    def prepare(self, log: EventLog) -> None:
        """Prepare the board for goals, before any is sent."""

    def read_status(self, channel: Channel) -> ChannelStatus | None:
        """Read one channel's pulse and the board's errors; None without an answer."""

    def send_limits(self, channels: Sequence[Channel]) -> bool:
        """Arm the speed limits of channels; return whether the board has confirmed them."""

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send the goals of channels, or the intermediate pulses on the way to them."""

"""Interface of a board that sends pulses to hobby servos; one class per kind of board.

A board either ramps its pulses to their goals itself, within limits armed in it (Maestro), or
applies pulses immediately, and the driver ramps them (PCA9685). In that case ``send_goals`` sends
intermediate pulses, and ``lead`` is called repeatedly.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from gazerig.drivers.bus.port_bus import Exchange
from gazerig.drivers.bus.timing import BusTiming
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig


class BoardLine(Exchange, Protocol):
    """The line to the board: byte and error counts, and late answers."""

    @property
    def lateness(self) -> HostLateness:
        """Return the counter of answers after their time-outs."""

    @property
    def port(self) -> BusPort:
        """Return the port."""


class BoardTexts(NamedTuple):
    """Texts of messages about a kind of board.

    name: name of the board, with its number or address
    no_pulses_remedy, other_pulse_remedy: remedies if a channel outputs no pulses, or other ones
        than commanded
    noise_remedy: remedy for a disturbed line
    no_answer_remedy: remedy if it does not answer
    unreachable_behaviour: behaviour of the servos when the board cannot be reached any more
    """

    name: str
    no_pulses_remedy: str
    other_pulse_remedy: str
    noise_remedy: str
    no_answer_remedy: str
    unreachable_behaviour: str


class ChannelStatus(NamedTuple):
    """Status of a channel and of its board.

    pulse_steps: present pulse of the channel, quarter microseconds; 0: none
    errors: names of the board's errors since the last read
    """

    pulse_steps: int
    errors: tuple[str, ...] = ()


class Board(Protocol):
    """One board, or several on one line; all methods may raise BusLost.

    line: line to the board; texts: texts of messages
    noise_errors: kinds of errors that noise causes
    """

    @property
    def line(self) -> BoardLine:
        """Return the line to the board."""

    @property
    def texts(self) -> BoardTexts:
        """Return the texts of messages about the board."""

    @property
    def timing(self) -> BusTiming:
        """Return the times of its bus."""

    @property
    def longest_ramp_s(self) -> float:
        """Return the longest time for which the driver's ramps advance while nothing is sent.

        inf: the board itself ramps pulses.
        """

    @property
    def noise_errors(self) -> Sequence[str]:
        """Return the kinds of errors that noise causes."""

    @property
    def params(self) -> HobbyBoardParams:
        """Return its parameters from the rig file."""

    def find(self, setups: Sequence[ServoConfig], log: EventLog) -> tuple[int, ...]:
        """Find the board and return the pulses of these servos; nothing moves.

        Raises:
            ServoMissing: it does not answer, or a channel is not a servo channel.
        """

    def prepare(self, log: EventLog) -> None:
        """Prepare the board for goals, before any is sent.

        Raises:
            ServoMissing: it does not answer.
        """

    def read_status(self, channel: Channel) -> ChannelStatus | None:
        """Read one channel's pulse and the board's errors; None without an answer."""

    def read_errors(self) -> tuple[str, ...] | None:
        """Read the errors of a board after a long silence; None without an answer."""

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Return the confirmed present pulses of channels; None after a failure."""

    def send_limits(self, channels: Sequence[Channel], confirmed: bool) -> bool:
        """Arm the speed limits of channels; return False if a requested confirmation fails."""

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send the goals of channels."""

    def resend_pulses(self, channels: Sequence[Channel]) -> None:
        """Hold the pulses while the board does not answer, if that is safe."""

    def advance_pulses(self, channels: Sequence[Channel]) -> None:
        """Advance pulses towards their goals if the board does not do so itself."""

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses; on the last try also by stronger means."""


def goals_of(channels: Sequence[Channel]) -> Mapping[int, int]:
    """Return the goals of channels by channel number."""
    return {channel.id: channel.goal_steps for channel in channels}

"""Interface of a board that sends pulses to hobby servos: each make implements it in one class.

A board either leads its pulses to their goals itself, at limits that are armed in it (Maestro), or
takes pulses as they are, and the driver leads them (PCA9685): then ``send_goals`` sends where
the pulses are on their way, and ``lead`` is called again and again.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from gazerig.drivers.bus.port_bus import Exchange
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoConfig


class BoardLine(Exchange, Protocol):
    """The line to the board: counts of every bus, and answers that came late."""

    @property
    def lateness(self) -> HostLateness:
        """Return the answers that came after waiting had ended."""
        ...

    @property
    def port(self) -> BusPort:
        """Return the port."""
        ...


class BoardTexts(NamedTuple):
    """Texts of messages about a make of board.

    name: of the board, with its number or address
    no_pulses, other_pulse: the remedy where a channel gives no pulses, or others than it is sent
    noise: the remedy where its line is disturbed
    no_answer: the remedy where it does not answer
    left_alone: what the servos do when the board cannot be reached any more
    """

    name: str
    no_pulses: str
    other_pulse: str
    noise: str
    no_answer: str
    left_alone: str


class ChannelStatus(NamedTuple):
    """What a board has reported of one channel and of itself.

    pulse_steps: what the channel gives now, quarter microseconds; 0: none
    errors: that it has found since it was asked last, by name
    """

    pulse_steps: int
    errors: tuple[str, ...] = ()


class Timing(NamedTuple):
    """Times and rates of a board.

    baud: bit/s of its port
    watch_s: period of its status requests
    stagger_s: between the first pulses of two servos
    give_up_s: longest silence or absence
    longest_lead_s: pulses that the driver leads go on for no longer than this where nothing was
        sent for a while; inf where the board itself leads them
    """

    baud: int
    watch_s: float
    stagger_s: float
    give_up_s: float
    longest_lead_s: float


class Board(Protocol):
    """One board, or several on one line; all may raise BusLost.

    line: carries the bytes; texts: of messages
    damage: kinds of errors that noise causes
    """

    @property
    def line(self) -> BoardLine:
        """Return the line to the board."""
        ...

    @property
    def texts(self) -> BoardTexts:
        """Return the texts of messages about the board."""
        ...

    @property
    def timing(self) -> Timing:
        """Return the board's time limits."""
        ...

    @property
    def damage(self) -> Sequence[str]:
        """Return the kinds of errors that noise causes."""
        ...

    @property
    def params(self) -> HobbyBoardParams:
        """Return what a rig file has chosen for it."""
        ...

    def find(self, setups: Sequence[ServoConfig], log: EventLog) -> tuple[int, ...]:
        """Find the board; return the pulses of these servos. Nothing moves.

        Raises:
            ServoMissing: it does not answer, or a channel is no servo's.
        """
        ...

    def prepare(self, log: EventLog) -> None:
        """Make it ready for goals, before any is sent.

        Raises:
            ServoMissing: it does not answer.
        """
        ...

    def look(self, channel: Channel) -> ChannelStatus | None:
        """Ask for one channel's pulse and the board's errors; None where no answer came."""
        ...

    def wake(self) -> tuple[str, ...] | None:
        """Ask a board that has long been silent for its errors; None where no answer came."""
        ...

    def pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Return what channels give now, confirmed; None where that did not succeed."""
        ...

    def send_limits(self, channels: Sequence[Channel], confirmed: bool) -> bool:
        """Arm what limits the speed of channels; False where it is to be confirmed and is not."""
        ...

    def send_goals(self, channels: Sequence[Channel]) -> None:
        """Send channels to their goals."""
        ...

    def steady(self, channels: Sequence[Channel]) -> None:
        """Hold the pulses while the board does not answer, if that is harmless."""
        ...

    def lead(self, channels: Sequence[Channel]) -> None:
        """Move pulses on towards their goals if the board does not do so itself."""
        ...

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses; on the last try by whatever else may help."""
        ...

    def wait(self, until_s: float) -> None:
        """Let time pass."""
        ...


def goals_of(channels: Sequence[Channel]) -> Mapping[int, int]:
    """Return the goals of channels by their numbers."""
    return {channel.id: channel.goal_steps for channel in channels}

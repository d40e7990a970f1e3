"""A board that sends pulses to hobby servos: its parameters, its line, and what a kind defines.

A board either ramps its pulses to their goals itself, within limits armed in it (Maestro), or
applies pulses immediately, and the driver ramps them (PCA9685). This module imports no more than
the guardian needs in an emergency.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, ClassVar

from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.errors import ServoMissing
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, TIMING, BusPort, BusTiming, open_port

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.hobby_board.channel import Channel
    from gazerig.drivers.types import ServoConfig

TRIES = 3
"""Number of attempts of operations that must not fail."""

CHECK_SUPPLY = "check its power and the cable"

ALIKE_STEPS = 400
"""Largest difference between two readings of a pulse that is moving."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HobbyBoardParams:
    """Properties of a board.

    baud: rate of its port: USB accepts any, and a bridge to I2C has this one
    pulse_range_us: shortest and longest pulse that may be sent, us, and the origin of both
    """

    baud: ClassVar[int] = 115_200
    pulse_range_us: ClassVar[tuple[float, float, str]]

    @property
    def channels(self) -> int:
        """Return the number of channels."""
        raise NotImplementedError

    def check_servo(self, setup: "ServoConfig") -> None:
        """Reject a servo that no channel can have.

        Raises:
            ValueError: no channel can have it; the message names the channel and the valid range.
        """
        if not 0 <= setup.id < self.channels:
            raise ValueError(f"channel {setup.id}: the board has channels 0 to {self.channels - 1}")
        low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
        least, most, decided = self.pulse_range_us
        if not least <= low <= high <= most:
            raise ValueError(
                f"channel {setup.id}: its range {low:g}..{high:g} us must be within "
                f"{least:g}..{most:g} us ({decided}): narrow the joint's range"
            )


class Board(ABC):
    """One board on a port that its user opens; all methods that send may raise BusLost.

    tx_bytes, rx_bytes, errors: counts since creation
    lateness: delays of this computer
    remedy: remedy if channels output other pulses than commanded
    longest_ramp_s: longest time for which the driver's ramps advance while nothing is sent; inf:
        the board itself ramps pulses
    """

    remedy: str
    longest_ramp_s: float = inf

    def __init__(self, port: BusPort, params: HobbyBoardParams, timing: BusTiming = TIMING) -> None:
        self.port, self.params, self.timing = port, params, timing
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.lateness = HostLateness()
        self._owed_bytes = 0

    @abstractmethod
    def find(self, setups: "Sequence[ServoConfig]") -> tuple[int, ...]:
        """Find the board and return the pulses of these servos; nothing moves.

        Raises:
            ServoMissing: it does not answer, or a channel is not a servo channel.
        """

    @abstractmethod
    def read_status(self, channel: int) -> tuple[int, tuple[str, ...]] | None:
        """Read a channel's pulse and the board's errors since the last read; None: no answer."""

    @abstractmethod
    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Read pulses, quarter microseconds, 0 for none; None without an answer."""

    @abstractmethod
    def send_limits(self, channels: "Sequence[Channel]") -> bool:
        """Arm the speed limits of channels; return whether the board has confirmed them."""

    @abstractmethod
    def send_goals(self, channels: "Sequence[Channel]") -> None:
        """Send the goals of channels, or the intermediate pulses on the way to them."""

    @abstractmethod
    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop the pulses of channels; on the last try also by stronger means."""

    def send(self, packet: bytes) -> None:
        """Send commands that are not answered."""
        self.port.write(packet)
        self.tx_bytes += len(packet)

    def exchange(self, packet: bytes, length: int) -> bytes:
        """Send requests and return their answers, fewer bytes if they do not come in time.

        Answers have neither address nor checksum, and a late one looks like any other: what arrives
        after a missing one is discarded.
        """
        port, owed, self._owed_bytes = self.port, self._owed_bytes, 0
        if owed and 0 < port.drain() <= owed:
            self.lateness.record_late_answer(port.now_s())
        wire_s = (len(packet) + length) * BITS_PER_BYTE / self.params.baud
        deadline_s = port.now_s() + wire_s + self.timing.reply_timeout_s
        port.drain(0.0)
        self.send(packet)
        answer = port.read_until(length, deadline_s)
        self.rx_bytes += len(answer)
        if len(answer) < length:
            self._owed_bytes = length - len(answer)
            self.lateness.record_wait(deadline_s, port.now_s())
        return answer

    def read_all(self, setups: "Sequence[ServoConfig]") -> tuple[int, ...]:
        """Read the pulses of servos, twice, as they decide where servos are held.

        Raises:
            ServoMissing: a channel does not answer.
        """
        ids = [setup.id for setup in setups]
        for _ in range(TRIES):
            first, again = self.read_pulses(ids), self.read_pulses(ids)
            if first is not None and again is not None and all(map(are_alike, first, again)):
                return again
        silent = (s.label("channel") for s in setups if self.read_pulses((s.id,)) is None)
        remedy = f"{CHECK_SUPPLY}; has the board {self.params.channels} channels?"
        raise self.missing(f"{next(silent, 'a channel')} does not answer", remedy)

    def missing(self, fault: str, remedy: str) -> ServoMissing:
        """Return the error of a fault at this port, with its remedy."""
        return ServoMissing(f"{self.port.port_name}: {self.blame(fault, remedy)}")

    def blame(self, fault: str, remedy: str) -> str:
        """Return a fault with its remedy, or with this computer as its cause if it was late."""
        return self.lateness.blame(fault, remedy, self.port.now_s())

    def switch_off(self, channels: Sequence[int]) -> ReleaseResult:
        """Stop the pulses and verify that they have stopped."""
        left, heard = tuple(channels), False
        for attempt in range(TRIES):
            self.stop(left, attempt == TRIES - 1)
            pulses = self.read_pulses(left)
            if pulses is not None:
                heard = True
                left = tuple(channel for channel, pulse in zip(left, pulses, strict=True) if pulse)
            if not left:
                break
        return ReleaseResult(left, ()) if heard else ReleaseResult((), left)


def are_alike(pulse: int, again: int) -> bool:
    """Return whether two readings of one pulse agree."""
    return bool(pulse) == bool(again) and abs(pulse - again) <= ALIKE_STEPS


def stop_pulses(board: Board, channels: Sequence[int]) -> tuple[int, ...]:
    """Open a board's port and stop the pulses; return the channels that did not confirm it.

    Other channels are not changed, unless these do not stop. The port stays open.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    open_port(board.port, board.params.baud)
    released = board.switch_off(channels)
    return (*released.holding_ids, *released.unconfirmed_ids)

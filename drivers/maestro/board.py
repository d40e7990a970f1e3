"""A Pololu Maestro as a board of hobby servos: it ramps its pulses to their goals itself.

A command byte has its highest bit set; data bytes do not. Answers are plain bytes, low byte first,
without a checksum. Source: Pololu Maestro Servo Controller User's Guide (0J40), sections 4.e and 5.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, inf
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple

from gazerig.drivers.hobby_board.board import TRIES, Board, HobbyBoardParams
from gazerig.drivers.serial.port import BusPort, open_port
from gazerig.params import Choices

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.hobby_board.channel import Channel
    from gazerig.drivers.types import ServoConfig

SET_TARGET, SET_SPEED, SET_ACCELERATION = 0x84, 0x87, 0x89
GET_POSITION, GET_ERRORS, STOP_SCRIPT = 0x90, 0xA1, 0xA4

MOST = 0x3FFF
"""Largest number in two data bytes; no pulse width and no error register is larger."""

MOST_INPUT = 1023
"""Largest answer of an input channel, which reports its voltage as 0..1023 instead of a pulse
width."""

MICRO = 6
"""Channels of the Micro Maestro, the smallest board."""

ERRORS = (
    "serial signal error",
    "serial overrun",
    "serial buffer full",
    "serial CRC error",
    "serial protocol error",
    "serial timeout",
    "script stack error",
    "script call stack error",
    "script program counter error",
)
"""Errors by bit of the error register."""

PROTOCOL_ERROR = "serial protocol error"

SPEED_STEPS_S = 100.0
"""Unit of the board's speed limit: a quarter microsecond in 10 ms."""

ACCEL_STEPS_S2 = SPEED_STEPS_S / 0.08
"""Unit of its acceleration limit: that change of speed in 80 ms."""

MOST_ACCEL = 255


USB_CHANNELS = {"1ffb:0089": 6, "1ffb:008a": 12, "1ffb:008b": 18, "1ffb:008c": 24}
"""Channels by USB vendor and product id."""


@lru_cache(maxsize=256)
def crc7(data: bytes) -> int:
    """Return the check byte of a command: CRC-7, polynomial 0x91, lowest bit first."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc ^ 0x91) >> 1 if crc & 1 else crc >> 1
    return crc


def name_errors(register: int) -> tuple[str, ...]:
    """Return the names of the set bits of the error register."""
    return tuple(name for bit, name in enumerate(ERRORS) if register >> bit & 1)


@dataclass(frozen=True, slots=True)
class MaestroParams(HobbyBoardParams):
    """Communication parameters of one board on its USB command port, and its commands."""

    # fmt: off
    crc: Annotated[bool, "Whether the board is set up for a CRC byte after every command; it ignores damaged commands then."] = False
    channels: Annotated[int, Choices(6, 12, 18, 24), "Number of channels of the board; the Micro Maestro has 6."] = 12
    # fmt: on
    pulse_range_us: ClassVar[tuple[float, float, str]] = (64.0, 4080.0, "the range of a Maestro")

    def command(self, code: int, *data: int) -> bytes:
        """Return the bytes of any command.

        Raises:
            ValueError: a data byte has its highest bit set.
        """
        if any(not 0 <= byte < 0x80 for byte in data):
            raise ValueError(f"command {code:02X}: data bytes must be 0..127, not {data}")
        packet = bytes((code, *data))
        return packet + bytes((crc7(packet),)) if self.crc else packet

    def number(self, code: int, channel: int, number: int) -> bytes:
        """Encode a target (0: no pulses) or a limit (0: none) of a channel, low byte first."""
        return self.command(code, channel, number & 0x7F, number >> 7)

    def targets(self, goals: Mapping[int, int]) -> bytes:
        """Encode pulse widths by channel; a damaged command affects no other channel."""
        return b"".join([self.number(SET_TARGET, *goal) for goal in goals.items()])


def speed_units(steps_s: float) -> int:
    """Return the smallest speed limit that is not below a speed; 0 (unlimited) if there is none."""
    return _units(steps_s / SPEED_STEPS_S, MOST)


def accel_units(steps_s2: float | None) -> int:
    """Return the smallest acceleration limit not below an acceleration; 0: unlimited."""
    return 0 if steps_s2 is None else _units(steps_s2 / ACCEL_STEPS_S2, MOST_ACCEL)


def _units(wanted: float, most: int) -> int:
    # A value slightly above whole units is a rounding error of an earlier conversion.
    return 0 if wanted > most else max(1, ceil(wanted - 1e-9))


class MaestroBoard(Board):
    """One board on its USB command port, or on its serial pins."""

    remedy = "set its channel to Servo and widen its range in Pololu's program, without a script"
    params: MaestroParams

    def find(self, setups: "Sequence[ServoConfig]") -> tuple[int, ...]:
        """Find the board, stop its own script and return the pulses of these servos."""
        if self.detect() is None:
            remedy = (
                "take the first of its two USB ports and set it to 'USB Dual Port' in Pololu's "
                f"program; its CRC must be {'on' if self.params.crc else 'off'}"
            )
            raise self.missing("no Maestro answers", remedy)
        self.send(self.params.command(STOP_SCRIPT))  # which would also move servos
        return self.read_all(setups)

    def read_errors(self) -> tuple[str, ...] | None:
        """Read the board's errors, which clears them; None if it is silent."""
        for _ in range(TRIES):
            answer = self._ask_words(self.params.command(GET_ERRORS), 1)
            if answer is not None and not answer[0] >> len(ERRORS):
                return name_errors(answer[0])
        return None

    def detect(self) -> tuple[str, ...] | None:
        """Read its errors; None without a board that expects such commands."""
        errors = self.read_errors()
        if errors is None or not self.params.crc:
            return errors
        # A board without check bytes answers too, but finds an error in every command.
        self.read_errors()
        return None if PROTOCOL_ERROR in (self.read_errors() or ()) else errors

    def read_status(self, channel: int) -> tuple[int, tuple[str, ...]] | None:
        """Read a channel's pulse and the board's errors since the last read; None: no answer."""
        command = self.params.command
        answer = self._ask_words(command(GET_POSITION, channel) + command(GET_ERRORS), 2)
        if answer is None or answer[1] >> len(ERRORS):
            return None  # such errors do not exist: noise
        return answer[0], name_errors(answer[1])

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Read pulses, quarter microseconds, 0 for none; None without an answer."""
        pulses: tuple[int, ...] = ()
        for channel in channels:  # one by one, as the board's receive buffer is small
            answer = self._ask_words(self.params.command(GET_POSITION, channel), 1)
            if answer is None:
                return None
            pulses += answer
        return pulses

    def _ask_words(self, packet: bytes, count: int) -> tuple[int, ...] | None:
        """Send requests and return their answers as 16-bit words; None without a good answer."""
        answer = self.exchange(packet, 2 * count)
        if len(answer) < 2 * count:
            self.errors["incomplete" if answer else "timeout"] += 1
            return None
        words = struct.unpack(f"<{count}H", answer)
        if max(words) > MOST:
            self.errors["damaged"] += 1
            return None
        return words

    def send_limits(self, channels: "Sequence[Channel]") -> bool:
        """Arm speed and acceleration; return whether the board has found no error.

        On an error it may have stopped all pulses, so no command that moves a servo may follow.
        """
        packet, params = b"", self.params
        for channel in channels:
            speed = speed_units(channel.top_speed_steps_s)
            accel = accel_units(channel.setup.max_accel_steps_s2)
            channel.speed_steps_s = speed * SPEED_STEPS_S or inf
            packet += params.number(SET_SPEED, channel.id, speed)
            packet += params.number(SET_ACCELERATION, channel.id, accel)
        return self._ask_words(packet + params.command(GET_ERRORS), 1) == (0,)

    def send_goals(self, channels: "Sequence[Channel]") -> None:
        """Send the goals of channels."""
        self.send(self.params.targets({one.id: one.goal_steps for one in channels}))

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop pulses."""
        self.send(self.params.targets(dict.fromkeys(channels, 0)))


class DetectedMaestro(NamedTuple):
    """A board that answers.

    expects_crc: whether it expects a check byte after every command
    errors: errors of its error register, which is now cleared
    pulses: pulse widths of the first channels, quarter microseconds; 0: no pulses
    """

    expects_crc: bool
    errors: tuple[str, ...]
    pulses: tuple[int, ...]


def probe(port: BusPort, params: MaestroParams) -> DetectedMaestro | None:
    """Return the Maestro at a port, None if no Maestro answers; nothing moves.

    The port stays open. A board treats unknown commands as errors, and on an error it sends its
    channels home. So the other setting of check bytes is tried only if it is silent, and only the
    channels that every board has are read.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    for crc in (params.crc, not params.crc):
        board = MaestroBoard(port, replace(params, crc=crc))
        open_port(port, params.baud)
        port.drain()
        errors = board.detect()
        if errors is not None:
            for _ in range(TRIES):  # a busy host may have been late, not the board
                pulses = board.read_pulses(range(MICRO))
                if pulses is not None:
                    return DetectedMaestro(crc, errors, pulses)
    return None

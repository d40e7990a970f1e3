"""Commands and answers of a Pololu Maestro as bytes; pure, nothing is sent here.

A command byte has its highest bit set; data bytes do not. In the compact form a command is followed
by its data.
Answers are plain bytes, low byte first, without a checksum. Source: Pololu Maestro Servo Controller
User's Guide (0J40), sections 4.e and 5.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil

SET_TARGET = 0x84
SET_SPEED = 0x87
SET_ACCELERATION = 0x89
GET_POSITION = 0x90
GET_MOVING = 0x93
SET_TARGETS = 0x9F
GET_ERRORS = 0xA1
GO_HOME = 0xA2
STOP_SCRIPT = 0xA4
SCRIPT_STATUS = 0xAE

WORD = 2
"""Bytes of an answer to get position and get errors."""

MOST = 0x3FFF
"""Largest number in two data bytes."""

LOWEST, HIGHEST = 64 * 4, 4080 * 4
"""Range of the board's pulse widths, quarter microseconds."""

MOST_INPUT = 1023
"""Largest answer of an input channel, which reports its voltage as 0..1023 instead of a pulse
width."""

MICRO = 6
"""Channels of the Micro Maestro, which has neither set multiple targets nor get moving."""

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

PROTOCOL_ERROR = ERRORS.index("serial protocol error")

_CRC_POLYNOMIAL = 0x91


def crc7(data: bytes) -> int:
    """Return the check byte of a command: CRC-7, polynomial 0x91, lowest bit first."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc ^ _CRC_POLYNOMIAL) >> 1 if crc & 1 else crc >> 1
    return crc


def name_errors(register: int) -> tuple[str, ...]:
    """Return the names of the set bits of the error register."""
    if not register:
        return ()
    named = [name for bit, name in enumerate(ERRORS) if register >> bit & 1]
    return (*named, "unknown error") if register >> len(ERRORS) else tuple(named)


def decode_words(answer: bytes) -> tuple[int, ...]:
    """Return the 16-bit words of an answer."""
    return struct.unpack(f"<{len(answer) // WORD}H", answer)


@dataclass(frozen=True, slots=True)
class MaestroCodec:
    """Encoder of commands in the form that a board expects.

    crc: whether every command ends in a check byte
    channels: number of channels, which decides the available commands
    """

    crc: bool = False
    channels: int = 12

    def command(self, code: int, *data: int) -> bytes:
        """Return the bytes of any command.

        Raises:
            ValueError: a data byte has its highest bit set.
        """
        if data and not 0 <= min(data) <= max(data) < 0x80:
            raise ValueError(f"command {code:02X}: data bytes must be 0..127, not {data}")
        packet = bytes((code, *data))
        return packet + bytes((crc7(packet),)) if self.crc else packet

    def target(self, channel: int, steps: int) -> bytes:
        """Encode a channel's target, a pulse width in quarter microseconds; 0: no pulses."""
        return self.command(SET_TARGET, channel, *seven_bit_bytes(steps))

    def targets(self, goals: Mapping[int, int]) -> bytes:
        """Encode targets: one command for every run of adjacent channels, if the board has it.

        goals: pulse width by channel, quarter microseconds
        """
        packet = b""
        for run in adjacent_runs(sorted(goals)):
            if len(run) > 1 and self.channels > MICRO:
                widths = [goals[channel] for channel in run]
                data = [0] * (2 * len(run))
                # Like ``seven_bit_bytes``, for all goals together; a width that does not fit is not
                # a data byte.
                data[0::2] = [width & 0x7F for width in widths]
                data[1::2] = [width >> 7 for width in widths]
                packet += self.command(SET_TARGETS, len(run), run[0], *data)
            else:
                packet += b"".join([self.target(channel, goals[channel]) for channel in run])
        return packet

    def speed(self, channel: int, units: int) -> bytes:
        """Encode a channel's speed limit, 0.25 us per 10 ms; 0: unlimited."""
        return self.command(SET_SPEED, channel, *seven_bit_bytes(units))

    def acceleration(self, channel: int, units: int) -> bytes:
        """Encode a channel's acceleration limit, 0..255 in 0.25 us per 10 ms per 80 ms; 0: none."""
        return self.command(SET_ACCELERATION, channel, *seven_bit_bytes(units))

    def position(self, channel: int) -> bytes:
        """Encode a request for a channel's present pulse width; the answer is a word."""
        return self.command(GET_POSITION, channel)

    def errors(self) -> bytes:
        """Encode a read of the error register, which clears it; the answer is a word."""
        return self.command(GET_ERRORS)

    def moving(self) -> bytes:
        """Encode a request for the motion of channels with a limit; the answer is a byte."""
        return self.command(GET_MOVING)

    def go_home(self) -> bytes:
        """Encode the command that sends all channels home, which may mean no pulses."""
        return self.command(GO_HOME)

    def stop_script(self) -> bytes:
        """Encode the command that stops the board's own script."""
        return self.command(STOP_SCRIPT)

    def script_status(self) -> bytes:
        """Encode a request for the script status; the answer is a byte, 0: the script runs."""
        return self.command(SCRIPT_STATUS)


def seven_bit_bytes(number: int) -> tuple[int, int]:
    """Return a number's two data bytes of seven bits, the low one first.

    Raises:
        ValueError: it does not fit.
    """
    if not 0 <= number <= MOST:
        raise ValueError(f"{number} does not fit into two data bytes: 0..{MOST}")
    return number & 0x7F, number >> 7


def adjacent_runs(channels: Sequence[int]) -> list[list[int]]:
    """Split ascending channels into runs of adjacent ones."""
    parted: list[list[int]] = []
    for channel in channels:
        if parted and parted[-1][-1] == channel - 1:
            parted[-1].append(channel)
        else:
            parted.append([channel])
    return parted


SPEED_STEPS_S = 100.0
"""Unit of the board's speed limit: a quarter microsecond in 10 ms."""

ACCEL_STEPS_S2 = SPEED_STEPS_S / 0.08
"""Unit of its acceleration limit: that change of speed in 80 ms."""

MOST_ACCEL = 255


def speed_units(steps_s: float) -> int:
    """Return the smallest speed limit that is not below a speed; 0 (unlimited) if there is none.

    Source: Pololu Maestro User's Guide (0J40), section 5.e.

    Raises:
        ValueError: it is not a positive number.
    """
    return _units(steps_s / SPEED_STEPS_S, MOST, "speed")


def accel_units(steps_s2: float | None) -> int:
    """Return the smallest limit that is not below an acceleration; 0 (unlimited) if there is none.

    Raises:
        ValueError: it is not a positive number.
    """
    return 0 if steps_s2 is None else _units(steps_s2 / ACCEL_STEPS_S2, MOST_ACCEL, "acceleration")


def _units(wanted: float, most: int, what: str) -> int:
    if not wanted > 0.0:
        raise ValueError(f"a {what} limit must be above 0, not {wanted}")
    # A value slightly above whole units is a rounding error of an earlier conversion.
    return 0 if wanted > most else max(1, ceil(wanted - 1e-9))

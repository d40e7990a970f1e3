"""Commands and answers of a Pololu Maestro as bytes; pure, nothing is sent here.

A command byte has its highest bit set; data bytes do not. In the compact form a command is followed
by its data. Answers are plain bytes, low byte first, without a checksum. Source: Pololu Maestro
Servo Controller User's Guide (0J40), sections 4.e and 5.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

SET_TARGET, SET_TARGETS, SET_SPEED, SET_ACCELERATION = 0x84, 0x9F, 0x87, 0x89
GET_POSITION, GET_ERRORS, STOP_SCRIPT, SCRIPT_STATUS = 0x90, 0xA1, 0xA4, 0xAE

MOST = 0x3FFF
"""Largest number in two data bytes; no pulse width and no error register is larger."""

MOST_INPUT = 1023
"""Largest answer of an input channel, which reports its voltage as 0..1023 instead of a pulse
width."""

MICRO = 6
"""Channels of the Micro Maestro, which has no command for several targets."""

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


@lru_cache(maxsize=256)
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
    return tuple(name for bit, name in enumerate(ERRORS) if register >> bit & 1)


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

    def number(self, code: int, channel: int, number: int) -> bytes:
        """Encode a number for a channel: target or limit, in two data bytes, the low one first.

        A target is a pulse width in quarter microseconds, 0 for no pulses; a speed is in 0.25 us
        per 10 ms and an acceleration in that per 80 ms, 0 for unlimited.
        """
        return self.command(code, channel, number & 0x7F, number >> 7)

    def targets(self, goals: Mapping[int, int]) -> bytes:
        """Encode targets: one command for every run of adjacent channels, if the board has it.

        goals: pulse width by channel, quarter microseconds
        """
        if self.channels <= MICRO:
            return b"".join([self.number(SET_TARGET, *goal) for goal in sorted(goals.items())])
        packet, run = b"", list[int]()
        for channel in sorted(goals):
            run.append(channel)
            if channel + 1 in goals:
                continue
            if len(run) == 1:
                packet += self.number(SET_TARGET, channel, goals[channel])
            else:
                widths = [goals[one] for one in run]
                data = [part for width in widths for part in (width & 0x7F, width >> 7)]
                packet += self.command(SET_TARGETS, len(run), run[0], *data)
            run.clear()
        return packet


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

"""Commands and answers of a Pololu Maestro as bytes; pure, nothing is sent here.

A command byte has its highest bit set, data bytes have not. The compact form is the
command and its data; the Pololu form puts AA and a device number before the command
without its highest bit. Answers are plain bytes, low byte first, and never checked.
Source: Pololu Maestro Servo Controller User's Guide (0J40), sections 4.e and 5.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gazerig.drivers.maestro.params import Form

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

POLOLU = 0xAA
"""Begins a command in the Pololu form; a board that detects its baud rate waits for it."""

WORD = 2
"""Bytes of an answer to get position and get errors."""

MOST = 0x3FFF
"""The greatest number in two data bytes."""

LOWEST, HIGHEST = 64 * 4, 4080 * 4
"""Pulse widths that the board can give, quarter microseconds."""

MOST_INPUT = 1023
"""A channel that is an input answers its voltage as 0..1023 instead of a pulse width."""

MICRO = 6
"""Channels of the Micro Maestro, which knows neither set multiple targets nor get moving."""

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
"""By bit of the error register."""

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
    """Name the set bits of the error register."""
    if not register:
        return ()
    named = [name for bit, name in enumerate(ERRORS) if register >> bit & 1]
    return (*named, "unknown error") if register >> len(ERRORS) else tuple(named)


def decode_words(answer: bytes) -> tuple[int, ...]:
    """Return the 16-bit words of an answer."""
    return struct.unpack(f"<{len(answer) // WORD}H", answer)


@dataclass(frozen=True, slots=True)
class MaestroCodec:
    """Encodes commands in the form that one board expects.

    form: "compact" or "pololu"; device: its number, 0..127, for the Pololu form
    crc: every command ends in a check byte
    channels: its size, which decides the commands it knows
    """

    form: Form = "compact"
    device: int = 12
    crc: bool = False
    channels: int = 12

    def command(self, code: int, *data: int) -> bytes:
        """Return the bytes of any command.

        Raises:
            ValueError: a data byte has its highest bit set.
        """
        if data and not 0 <= min(data) <= max(data) < 0x80:
            raise ValueError(f"command {code:02X}: data bytes must be 0..127, not {data}")
        head = (code,) if self.form == "compact" else (POLOLU, self.device, code & 0x7F)
        packet = bytes((*head, *data))
        return packet + bytes((crc7(packet),)) if self.crc else packet

    def target(self, channel: int, steps: int) -> bytes:
        """Send a channel to a pulse width in quarter microseconds; 0: no pulses."""
        return self.command(SET_TARGET, channel, *split(steps))

    def targets(self, goals: Mapping[int, int]) -> bytes:
        """Send channels to pulse widths: one command for every run of neighbours where it can.

        goals: pulse width by channel, quarter microseconds
        """
        packet = b""
        for run in runs(sorted(goals)):
            if len(run) > 1 and self.channels > MICRO:
                widths = [goals[channel] for channel in run]
                data = [0] * (2 * len(run))
                # As ``split``, of all at once; what does not fit is not a data byte.
                data[0::2] = [width & 0x7F for width in widths]
                data[1::2] = [width >> 7 for width in widths]
                packet += self.command(SET_TARGETS, len(run), run[0], *data)
            else:
                packet += b"".join([self.target(channel, goals[channel]) for channel in run])
        return packet

    def speed(self, channel: int, units: int) -> bytes:
        """Limit a channel's speed, 0.25 us per 10 ms; 0: unlimited."""
        return self.command(SET_SPEED, channel, *split(units))

    def acceleration(self, channel: int, units: int) -> bytes:
        """Limit a channel's acceleration, 0..255 in 0.25 us per 10 ms per 80 ms; 0: unlimited."""
        return self.command(SET_ACCELERATION, channel, *split(units))

    def position(self, channel: int) -> bytes:
        """Ask for the pulse width that a channel gives now; a word."""
        return self.command(GET_POSITION, channel)

    def errors(self) -> bytes:
        """Ask for the error register, which is cleared so; a word."""
        return self.command(GET_ERRORS)

    def moving(self) -> bytes:
        """Ask whether a channel with a limit is still on its way; a byte."""
        return self.command(GET_MOVING)

    def go_home(self) -> bytes:
        """Send all channels to their home, which may be: no pulses."""
        return self.command(GO_HOME)

    def stop_script(self) -> bytes:
        """Stop the board's own script."""
        return self.command(STOP_SCRIPT)

    def script_status(self) -> bytes:
        """Ask whether the board's own script has stopped; a byte, 0: it runs."""
        return self.command(SCRIPT_STATUS)


def split(number: int) -> tuple[int, int]:
    """Return a number's two data bytes of seven bits, the low one first.

    Raises:
        ValueError: it does not fit into them.
    """
    if not 0 <= number <= MOST:
        raise ValueError(f"{number} does not fit into two data bytes: 0..{MOST}")
    return number & 0x7F, number >> 7


def runs(channels: Sequence[int]) -> list[list[int]]:
    """Part ascending channels into runs of neighbours."""
    parted: list[list[int]] = []
    for channel in channels:
        if parted and parted[-1][-1] == channel - 1:
            parted[-1].append(channel)
        else:
            parted.append([channel])
    return parted

"""Parsing of the commands in the bytes that an emulated Maestro receives.

Command bytes have bit 7 set, data bytes do not. Two forms: compact ``84 ch lo hi``, and Mini SSC
``FF servo target``, whose last two bytes are 0..254. Commands of the Pololu form, ``AA device 04 ch
lo hi``, are ignored, as for another device. Source: Pololu Maestro User's Guide (0J40), sections
5.c to 5.f.
"""

from collections.abc import Iterator
from typing import Literal, NamedTuple

SET_TARGET, SET_TARGETS, SET_SPEED, SET_ACCELERATION, SET_PWM = 0x84, 0x9F, 0x87, 0x89, 0x8A
GET_POSITION, GET_MOVING, GET_ERRORS, GO_HOME = 0x90, 0x93, 0xA1, 0xA2
STOP_SCRIPT, RUN_SCRIPT, RUN_SCRIPT_WITH, GET_SCRIPT = 0xA4, 0xA7, 0xA8, 0xAE
POLOLU, MINI_SSC = 0xAA, 0xFF

DATA_BYTES = {
    SET_TARGET: 3,
    SET_SPEED: 3,
    SET_ACCELERATION: 3,
    GET_POSITION: 1,
    GET_MOVING: 0,
    GET_ERRORS: 0,
    GO_HOME: 0,
    STOP_SCRIPT: 0,
    RUN_SCRIPT: 1,
    RUN_SCRIPT_WITH: 3,
    GET_SCRIPT: 0,
    SET_PWM: 4,
    SET_TARGETS: 2,
}
"""Number of data bytes; for set-targets those before the targets."""
MINI_ONLY = (SET_TARGETS, SET_PWM)
"""The Micro Maestro, with six channels, does not support these."""

ERRORS = (
    "signal",
    "overrun",
    "buffer-full",
    "crc",
    "protocol",
    "timeout",
    "script-stack",
    "script-call-stack",
    "script-counter",
)
"""Names by the bits of the error register."""

Trouble = Literal["", "crc", "protocol"]


class ParsedCommand(NamedTuple):
    """One command, or an error in the bytes.

    end: its end among the bytes fed
    code: the command byte, 0 on trouble
    """

    end: int
    code: int
    data: bytes = b""
    error: Trouble = ""


class CommandParser:
    """Stores the received bytes of an incomplete command.

    mini: whether the board has 12, 18 or 24 channels
    """

    def __init__(self, mini: bool) -> None:
        self.crc = False
        self._known = {
            code: size for code, size in DATA_BYTES.items() if mini or code not in MINI_ONLY
        }
        self._packet = bytearray()
        self._until = 0
        self._deaf = False

    def forget(self) -> None:
        """Drop an unfinished command."""
        self._packet.clear()
        self._deaf = False

    def feed(self, data: bytes) -> Iterator[ParsedCommand]:
        """Yield the commands that bytes complete, fed one by one."""
        for end, byte in enumerate(data, 1):
            packet, found = self._packet, tuple[ParsedCommand, ...]()
            if byte & 0x80 and not (packet and packet[0] == MINI_SSC and byte != MINI_SSC):
                found = self._begin(byte)
            elif not self._deaf and not packet:
                found = (_PROTOCOL,)
            elif not self._deaf:
                packet.append(byte)
                found = self._check_complete() if len(packet) >= self._until else ()
            for command in found:
                yield command._replace(end=end)

    def _begin(self, byte: int) -> tuple[ParsedCommand, ...]:
        """Start a command; an unfinished one is an error."""
        packet = self._packet
        said = (_PROTOCOL,) if packet else ()
        self._deaf = byte == POLOLU
        packet[:] = b"" if self._deaf else (byte,)
        if byte in (POLOLU, MINI_SSC):
            self._until = 3
            return said
        return said + self._check_complete()

    def _check_complete(self) -> tuple[ParsedCommand, ...]:
        """Check whether the command is complete, or when to check again."""
        packet = self._packet
        code = packet[0]
        if code == MINI_SSC:
            return self._complete(code)
        if code not in self._known:
            packet.clear()
            return (_PROTOCOL,)
        self._until = 1 + self._known[code] + self.crc
        if code == SET_TARGETS:
            # Its first byte gives its length.
            self._until = self._until + 2 * packet[1] if len(packet) > 1 else 2
        return self._complete(code) if len(packet) >= self._until else ()

    def _complete(self, code: int) -> tuple[ParsedCommand, ...]:
        packet = bytes(self._packet)
        self._packet.clear()
        if self.crc and code != MINI_SSC:
            packet, check = packet[:-1], packet[-1]
            if crc7(packet) != check:
                return (ParsedCommand(0, 0, error="crc"),)
        return (ParsedCommand(0, code, packet[1:]),)


_PROTOCOL = ParsedCommand(0, 0, error="protocol")


def decode_word(low: int, high: int) -> int:
    """Return the number in two data bytes."""
    return low | high << 7


def crc7(data: bytes) -> int:
    """Return the checksum of a command: CRC-7 with the polynomial 91 hex, lowest bit first."""
    rest = 0
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = (rest ^ 0x91 if rest & 1 else rest) >> 1
    return rest

"""I2C transfers as bytes, as NXP's SC18IM700 takes them from a serial line; pure.

All ports of servos carry bytes, so these carry I2C: a bridge on a serial line, an emulated one
on a pseudo-terminal, and gazerig.drivers.i2c.port, which does with the kernel's buses what a
bridge does with its own. S begins, then the address with its direction bit and a count, and of a
write so many bytes; P ends. R, a register, P reads the bridge's own; register 0A tells how the last
transfer ended. Source: NXP, SC18IM700 data sheet, rev. 2 (10 August 2007).
"""

from collections.abc import Iterator
from typing import NamedTuple

START, STOP, READ_REGISTER = ord("S"), ord("P"), ord("R")
STATUS_REGISTER = 0x0A
ASK_STATUS = bytes((READ_REGISTER, STATUS_REGISTER, STOP))
OK, NO_ACKNOWLEDGE, TIMED_OUT = 0xF0, 0xF1, 0xF8
OUTCOMES = {
    OK: "",
    NO_ACKNOWLEDGE: "not acknowledged",
    0xF2: "not acknowledged",
    0xF3: "not acknowledged",
    TIMED_OUT: "bus stuck",
}
"""Status byte -> what went wrong."""


def write(address: int, register: int, data: bytes) -> bytes:
    """Return a write of some registers."""
    return bytes((START, address << 1, len(data) + 1, register)) + data + bytes((STOP,))


def write_all(data: int) -> bytes:
    """Return a byte to all devices of the bus, by its general call address."""
    return bytes((START, 0, 1, data, STOP))


def read(address: int, register: int, length: int) -> bytes:
    """Return a read of some registers."""
    return bytes((START, address << 1, 1, register, START, address << 1 | 1, length, STOP))


class Part(NamedTuple):
    """One start of a transfer; length: of a read, None where it writes."""

    address: int
    data: bytes
    length: int | None = None


def commands(text: bytes) -> Iterator[tuple[Part, ...]]:
    """Yield the parts of each command; a status request has none.

    Raises:
        ValueError: the bytes are not whole commands.
    """
    at = 0
    while at < len(text):
        if text.startswith(ASK_STATUS, at):
            at += len(ASK_STATUS)
            yield ()
            continue
        parts = []
        while at < len(text) and text[at] == START:
            address, count = text[at + 1], text[at + 2]
            at += 3
            if address & 1:
                parts.append(Part(address >> 1, b"", count))
            else:
                parts.append(Part(address >> 1, text[at : at + count]))
                at += count
        if not parts or at >= len(text) or text[at] != STOP:
            raise ValueError(f"no whole command: {text.hex(' ')}")
        at += 1
        yield tuple(parts)

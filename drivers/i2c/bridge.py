"""I2C transfers as bytes, in the format of NXP's SC18IM700 on a serial line; pure.

All servo ports carry bytes, and these bytes carry I2C: to a bridge on a serial line, to an emulated
one on a pseudo-terminal, and to gazerig.drivers.i2c.port, which executes them on the kernel's
buses. A transfer is S, the address with its direction bit, a count, for a write that number of
bytes, and P. R, a register and P read a register of the bridge; register 0A contains the result of
the last transfer. Source: NXP, SC18IM700 data sheet, rev. 2 (10 August 2007).
"""

from collections.abc import Iterator
from typing import NamedTuple

START, STOP, READ_REGISTER = ord("S"), ord("P"), ord("R")
STATUS_REGISTER = 0x0A
READ_STATUS = bytes((READ_REGISTER, STATUS_REGISTER, STOP))
OK, NO_ACKNOWLEDGE, TIMED_OUT = 0xF0, 0xF1, 0xF8
OUTCOMES = {
    OK: "",
    NO_ACKNOWLEDGE: "not acknowledged",
    0xF2: "not acknowledged",
    0xF3: "not acknowledged",
    TIMED_OUT: "bus stuck",
}
"""Status byte -> error, "" for none."""


def write(address: int, register: int, data: bytes) -> bytes:
    """Build a write of some registers."""
    return bytes((START, address << 1, len(data) + 1, register)) + data + bytes((STOP,))


def write_all(data: int) -> bytes:
    """Build a write of one byte to all devices of the bus, at the general call address."""
    return bytes((START, 0, 1, data, STOP))


def read(address: int, register: int, length: int) -> bytes:
    """Build a read of some registers."""
    return bytes((START, address << 1, 1, register, START, address << 1 | 1, length, STOP))


class I2cMessage(NamedTuple):
    """One message of a transfer; length: number of bytes to read, None for a write."""

    address: int
    data: bytes
    length: int | None = None


def commands(text: bytes) -> Iterator[tuple[I2cMessage, ...]]:
    """Yield the parts of each command; a status request has none.

    Raises:
        ValueError: the bytes are not whole commands.
    """
    at = 0
    while at < len(text):
        if text.startswith(READ_STATUS, at):
            at += len(READ_STATUS)
            yield ()
            continue
        parts = []
        while at < len(text) and text[at] == START:
            address, count = text[at + 1], text[at + 2]
            at += 3
            if address & 1:
                parts.append(I2cMessage(address >> 1, b"", count))
            else:
                parts.append(I2cMessage(address >> 1, text[at : at + count]))
                at += count
        if not parts or at >= len(text) or text[at] != STOP:
            raise ValueError(f"no whole command: {text.hex(' ')}")
        at += 1
        yield tuple(parts)

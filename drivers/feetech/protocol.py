"""Packets of the Feetech STS servos as bytes: build instructions, parse statuses.

instruction  FF FF | id | length | instruction | params | checksum
status       FF FF | id | length | error       | params | checksum
length counts what follows it; checksum is the inverse of the sum from the id to the last
param. A status looks like an instruction: an adapter that echoes what is sent gives back a
ping that looks like its own answer, so nothing here trusts a status by its form alone, and
a read asks for a length that the question does not have.

The checksum is one byte wide and a sum: a lost byte whose place the next header takes
passes it now and then. Such a status overlaps the next one, so statuses that overlap are
rejected.

Source: Feetech, communication protocol of the SCS and STS series.
"""

import struct
from collections.abc import Iterable, Sequence
from typing import Literal
from zlib import adler32

from gazerig.drivers.servo_bus.family import Identity, Status

HEADER = b"\xff\xff"
BROADCAST = 0xFE
PING, READ, WRITE, REG_WRITE, ACTION, RESET, REBOOT = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08
SYNC_READ, SYNC_WRITE = 0x82, 0x83

STATUS_OVERHEAD = 6
"""Bytes of a status without params."""

REFUSAL = 0
"""No bit of the error byte says that an order was refused: it says how the servo is."""

ALERT = 0xFF
"""Bits of the error byte that say that something ails the servo."""

ECHO_LENGTH = 2
"""A question about registers has two params, as an answer of two bytes has."""

IDENTITY_LENGTH = 9
"""Registers 0..8: firmware, model, id, baud rate, return delay, status level."""

SCS_SERIES = 5
"""First byte of the model number (3) of the servos whose high byte comes first."""

LONGEST_STATUS = 128
"""Length of a status with more than the whole table: noise."""


def instruction(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """Build an instruction packet.

    Raises:
        ValueError: the params are too many for one packet.
    """
    if len(params) > 253:
        raise ValueError(
            f"{len(params)} bytes do not fit into one packet: ask fewer servos at once"
        )
    body = bytes((servo_id, len(params) + 2, code)) + params
    return HEADER + body + bytes((checksum(body),))


def checksum(body: bytes) -> int:
    """Return the checksum over the bytes from the id to the last param."""
    return ~sum(body) & 0xFF


def ping(servo_id: int) -> bytes:
    """Build a ping; its echo looks like its answer."""
    return instruction(servo_id, PING)


def reboot(servo_id: int) -> bytes:
    """Build a reboot instruction."""
    return instruction(servo_id, REBOOT)


def identify(servo_id: int) -> bytes:
    """Build a read of the first registers, which hold model and firmware."""
    return read(servo_id, 0, IDENTITY_LENGTH)


def identity(status: Status) -> Identity | None:
    """Return model and firmware from the first registers, None if the status holds others.

    The firmware is a hundred times the major version and the minor one, 310 for 3.10. The model
    number of an SCS servo has the high byte first.
    """
    data = status.params
    if len(data) != IDENTITY_LENGTH or data[5] != status.id:
        return None
    order: Literal["little", "big"] = "big" if data[3] == SCS_SERIES else "little"
    return Identity(int.from_bytes(data[3:5], order), 100 * data[0] + data[1])


def read(servo_id: int, address: int, length: int) -> bytes:
    """Build a request for registers of one servo."""
    return instruction(servo_id, READ, bytes((address, length)))


def write(servo_id: int, address: int, data: bytes) -> bytes:
    """Build a write to registers of one servo."""
    return instruction(servo_id, WRITE, bytes((address,)) + data)


def reg_write(servo_id: int, address: int, data: bytes) -> bytes:
    """Build a write to registers of one servo that takes effect at the next action."""
    return instruction(servo_id, REG_WRITE, bytes((address,)) + data)


def sync_read(ids: Sequence[int], address: int, length: int) -> bytes:
    """Build a request for the same registers of several servos."""
    return instruction(BROADCAST, SYNC_READ, bytes((address, length, *ids)))


def sync_write(ids: Sequence[int], address: int, size: int, rows: Iterable[bytes]) -> bytes:
    """Build a write to the same registers of several servos, ``size`` bytes each."""
    body = b"".join(bytes((i,)) + row for i, row in zip(ids, rows, strict=True))
    return instruction(BROADCAST, SYNC_WRITE, bytes((address, size)) + body)


MOST_GOALS = 35
"""So many servos' goals fit into one packet: 7 bytes each."""


class GoalWrite:
    """Builds the packets that write goal, time and speed (42..47) of several servos at once."""

    ADDRESS, SIZE, ORDER = 42, 6, "<"

    def __init__(self, ids: Sequence[int]) -> None:
        self._head = bytes((BROADCAST, 4 + 7 * len(ids), SYNC_WRITE, self.ADDRESS, self.SIZE))
        self._rows = struct.Struct(self.ORDER + "BHHH" * len(ids))
        self._row = [number for servo_id in ids for number in (servo_id, 0, 0, 0)]

    def packet(self, goals: Sequence[int], speeds: Sequence[int]) -> bytes:
        """Build the packet for one goal, 0 or above, and one speed a servo."""
        row = self._row
        row[1::4] = goals
        row[3::4] = speeds
        body = self._head + self._rows.pack(*row)
        return b"%b%b%c" % (HEADER, body, ~sum(body) & 0xFF)


def statuses(raw: bytes) -> list[Status]:
    """Return every complete status packet in received bytes; noise, echo and parts are skipped.

    Of two that overlap and are both right by their checksum neither can be believed: they
    are given as not intact.
    """
    found: list[tuple[int, int, Status]] = []
    at = _header(raw, 0)
    while at >= 0:
        end = _end(raw, at)
        if end is not None and end <= len(raw):
            intact = checksum(raw[at + 2 : end - 1]) == raw[end - 1]
            params = raw[at + 5 : end - 1]
            found.append((at, end, Status(raw[at + 2], raw[at + 4], params, intact, at)))
        at = _header(raw, at + 1)
    return _apart(found)


CHECK = "B"
"""Struct code of the checksum."""


def status_head(servo_id: int, length: int) -> bytes:
    """Return a status's bytes before its error byte; ``length``: of its params."""
    return HEADER + bytes((servo_id, length + 2))


CHECKED = (2, 0)
"""So many bytes at the beginning and at the end of a status are not under its checksum."""


def all_intact(parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
    """Return whether the checksums of statuses are right, from the id to the checksum of each.

    A checksum is the inverse of the sum before it, so all of them add up to 0xFF. The lower half
    of Adler-32 is one more than the sum, and is counted nine times as fast.
    """
    return not any(map((0xFF).__and__, map(adler32, parts)))


def _apart(found: Sequence[tuple[int, int, Status]]) -> list[Status]:
    """Leave out what looked like a status inside a right one; spoil right ones that overlap."""
    right = [(at, end) for at, end, status in found if status.intact]
    kept = []
    for at, end, status in found:
        across = [span for span in right if span != (at, end) and span[0] < end and at < span[1]]
        if not across:
            kept.append(status)
        elif status.intact:
            kept.append(status._replace(intact=False))
    return kept


def bytes_missing(raw: bytes, count: int, length: int) -> int:
    """Count the bytes still to come of ``count`` statuses with ``length`` bytes of params each."""
    nominal = length + STATUS_OVERHEAD
    seen, done = 0, 0
    at = _header(raw, 0)
    while at >= 0:
        end = _end(raw, at)
        if end is not None and end <= len(raw):
            seen, done = seen + 1, end
        at = _header(raw, done if done > at else at + 1)
    if seen >= count:
        return 0
    at = _header(raw, done)
    begun = len(raw) - at if at >= 0 else int(raw[done:].endswith(b"\xff"))
    return (count - seen - 1) * nominal + max(1, nominal - begun)


def _header(raw: bytes, start: int) -> int:
    """Return where the next header is: the last FF FF of a row; -1 where none is."""
    at = raw.find(HEADER, start)
    while 0 <= at < len(raw) - 2 and raw[at + 2] == 0xFF:
        at = raw.find(HEADER, at + 1)
    return at


def _end(raw: bytes, at: int) -> int | None:
    """Return where the status that starts at ``at`` ends, None where none does."""
    if len(raw) - at < STATUS_OVERHEAD:
        return None
    length = raw[at + 3]
    return at + 4 + length if 2 <= length <= LONGEST_STATUS else None

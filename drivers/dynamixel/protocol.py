"""Packets of Dynamixel Protocol 2.0 as bytes: build instructions, parse statuses.

The SDK does not stuff its packets, and its group reads lose every answer after a missing one, so
the packets of the control loop are built here.

instruction FF FF FD 00 | id | length | instruction | params | CRC status FF FF FD 00 | id | length
| 55 | error | params | CRC length counts the bytes after it. After it, FF FF FD is sent as FF FF FD
FD (stuffing).
"""

import struct
from collections.abc import Iterable, Sequence

from fastcrc.crc16 import umts

from gazerig.drivers.servo_bus.family import Identity, Status

HEADER = b"\xff\xff\xfd\x00"
RAW, STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
BROADCAST = 0xFE
STATUS = 0x55
PING, READ, WRITE = 0x01, 0x02, 0x03
SYNC_READ, SYNC_WRITE, FAST_SYNC_READ = 0x82, 0x83, 0x8A

STATUS_OVERHEAD = 11
"""Bytes of a status in addition to its params."""

ERROR_NUMBER, ALERT = 0x7F, 0x80
"""Parts of the error byte: reason of a failed instruction; flag of a latched hardware error."""

REFUSAL = ERROR_NUMBER

ECHO_LENGTH = None
"""An answer contains a byte that no instruction has, so an echo never looks like an answer."""

LONGEST_STATUS = 256
"""Length of the longest expected answer; a larger length is noise."""

_IDENTITY = struct.Struct("<HB")
IDENTITY_LENGTH = _IDENTITY.size

_HEAD = struct.Struct("<4sBHB")
_SPAN = struct.Struct("<HH")
_CRC = struct.Struct("<H")
_VALUE = {1: "B", 2: "h", 4: "i"}


def instruction(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """Build an instruction packet, stuffed if needed."""
    if RAW in params:
        params = params.replace(RAW, STUFFED)
    packet = _HEAD.pack(HEADER, servo_id, len(params) + 3, code) + params
    return packet + _CRC.pack(umts(packet))


def ping(servo_id: int) -> bytes:
    """Build a ping."""
    return instruction(servo_id, PING)


identity_request = ping
"""The answer to a ping contains model and firmware."""


def parse_identity(status: Status) -> Identity | None:
    """Return model and firmware from the answer to a ping, None if it is not one."""
    if len(status.params) != IDENTITY_LENGTH or status.error & ERROR_NUMBER:
        return None
    return Identity(*_IDENTITY.unpack(status.params))


def read(servo_id: int, address: int, length: int) -> bytes:
    """Build a request for registers of one servo."""
    return instruction(servo_id, READ, _SPAN.pack(address, length))


def write(servo_id: int, address: int, data: bytes) -> bytes:
    """Build a write to registers of one servo."""
    return instruction(servo_id, WRITE, address.to_bytes(2, "little") + data)


def sync_read(ids: Sequence[int], address: int, length: int, fast: bool = False) -> bytes:
    """Build a request for the same registers of several servos."""
    code = FAST_SYNC_READ if fast else SYNC_READ
    return instruction(BROADCAST, code, _SPAN.pack(address, length) + bytes(ids))


def sync_write(ids: Sequence[int], address: int, size: int, rows: Iterable[bytes]) -> bytes:
    """Build a write to the same registers of several servos, ``size`` bytes each."""
    body = b"".join(bytes((i,)) + row for i, row in zip(ids, rows, strict=True))
    return instruction(BROADCAST, SYNC_WRITE, _SPAN.pack(address, size) + body)


class SyncWrite:
    """Builder of packets that write one register of a fixed set of servos."""

    def __init__(self, ids: Sequence[int], address: int, size: int) -> None:
        self._params = _SPAN.pack(address, size)
        self._rows = struct.Struct("<" + ("B" + _VALUE[size]) * len(ids))
        length = 3 + _SPAN.size + self._rows.size
        self._head = _HEAD.pack(HEADER, BROADCAST, length, SYNC_WRITE) + self._params
        self._row = [number for servo_id in ids for number in (servo_id, 0)]

    def packet(self, values: Sequence[int], speeds: Sequence[int] = ()) -> bytes:
        """Build the packet with one value per servo; speeds are in the servos' own profiles."""
        row = self._row
        row[1::2] = values
        body = self._rows.pack(*row)
        if RAW in body:
            return instruction(BROADCAST, SYNC_WRITE, self._params + body)
        packet = self._head + body
        return packet + _CRC.pack(umts(packet))


def parse_statuses(raw: bytes) -> list[Status]:
    """Return every complete status packet in received bytes; skip noise, echoes and fragments."""
    found = []
    at = raw.find(HEADER)
    while at >= 0:
        end = _end(raw, at)
        if end is None or end > len(raw):
            at = raw.find(HEADER, at + len(HEADER))
            continue
        intact = umts(raw[at : end - 2]) == _CRC.unpack_from(raw, end - 2)[0]
        params = raw[at + 9 : end - 2].replace(STUFFED, RAW)
        found.append(Status(raw[at + 4], raw[at + 8], params, intact, at))
        at = raw.find(HEADER, end if intact else at + len(HEADER))
    return found


CHECK = "H"
"""Struct code of the CRC."""


def status_head(servo_id: int, length: int) -> bytes:
    """Return a status's bytes before its error byte; ``length``: number of params."""
    return _HEAD.pack(HEADER, servo_id, length + 4, STATUS)


CHECKED = (0, 2)
"""Bytes at the beginning and at the end of a status that its CRC does not cover."""


def all_intact(parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
    """Return whether the CRCs of statuses match the parts that they cover."""
    return tuple(map(umts, parts)) == checks


def bytes_missing(raw: bytes, count: int, length: int) -> int:
    """Return how many bytes of ``count`` statuses with ``length`` params have not arrived yet.

    Stuffing makes a status longer; its own length field is used once it has arrived.
    """
    nominal = length + STATUS_OVERHEAD
    seen, done = 0, 0
    at = raw.find(HEADER)
    while at >= 0:
        end = _end(raw, at)
        if end is not None and end <= len(raw):
            seen, done = seen + 1, end
        at = raw.find(HEADER, done if done > at else at + len(HEADER))
    if seen >= count:
        return 0
    at = raw.rfind(HEADER, done)
    end = _end(raw, at) if at >= 0 else None
    begun = (
        len(raw) - at
        if at >= 0
        else next((n for n in (3, 2, 1) if raw[done:].endswith(HEADER[:n])), 0)
    )
    rest = nominal - begun if begun < STATUS_OVERHEAD else 0
    return (count - seen - 1) * nominal + (end - len(raw) if end is not None else rest)


def _end(raw: bytes, at: int) -> int | None:
    """Return the end of the status that starts at ``at``, None if no status does."""
    if len(raw) - at < STATUS_OVERHEAD or raw[at + 7] != STATUS:
        return None
    length = int.from_bytes(raw[at + 5 : at + 7], "little")
    return at + 7 + length if 4 <= length <= LONGEST_STATUS else None

"""Packets of Dynamixel Protocol 2.0 as bytes: build instructions, parse statuses.

The SDK does not stuff its packets, and its group reads lose every answer after a missing one, so
the packets of the control loop are built here.

instruction FF FF FD 00 | id | length | instruction | params | CRC status FF FF FD 00 | id | length
| 55 | error | params | CRC length counts the bytes after it. After it, FF FF FD is sent as FF FF FD
FD (stuffing).
"""

import struct
from collections.abc import Sequence

from fastcrc.crc16 import umts

from gazerig.drivers.servo_bus.family import BROADCAST, PING, AnswerFrame, Identity, Status

HEADER = b"\xff\xff\xfd\x00"
RAW, STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
STATUS = 0x55

STATUS_OVERHEAD = 11
"""Bytes of a status in addition to its params."""

ERROR_NUMBER, ALERT = 0x7F, 0x80
"""Parts of the error byte: reason of a failed instruction; flag of a latched hardware error."""

REFUSAL = ERROR_NUMBER

LONGEST_STATUS = 256
"""Length of the longest expected answer; a larger length is noise."""

_IDENTITY = struct.Struct("<HB")
IDENTITY_LENGTH = _IDENTITY.size

_HEAD = struct.Struct("<4sBHB")
_CRC = struct.Struct("<H")


def instruction(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """Build an instruction packet, stuffed if needed."""
    if RAW in params:
        params = params.replace(RAW, STUFFED)
    packet = _HEAD.pack(HEADER, servo_id, len(params) + 3, code) + params
    return packet + _CRC.pack(umts(packet))


number = struct.Struct("<H").pack
"""Returns the bytes for an address or a number of bytes."""


def identity_request(servo_id: int) -> bytes:
    """Build a ping; its answer contains model and firmware."""
    return instruction(servo_id, PING)


def parse_identity(status: Status) -> Identity | None:
    """Return model and firmware from the answer to a ping, None if it is not one."""
    if len(status.params) != IDENTITY_LENGTH or status.error & ERROR_NUMBER:
        return None
    return Identity(*_IDENTITY.unpack(status.params))


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
        found.append(Status(raw[at + 4], raw[at + 8], params, intact))
        at = raw.find(HEADER, end if intact else at + len(HEADER))
    return found


def answer_frame(ids: Sequence[int], length: int, fast: bool) -> AnswerFrame:
    """Return the frame of the answer to a sync read of ``length`` bytes, fast or not."""
    count = len(ids)
    if not fast:
        heads = [_HEAD.pack(HEADER, i, length + 4, STATUS) + b"\x00" for i in ids]
        return AnswerFrame(heads, "H", f"{length + 9}s2x" * count, _are_intact)
    front = _HEAD.pack(HEADER, BROADCAST, (length + 4) * count + 1, STATUS)
    # Each part reaches from the previous CRC, or the begin, up to a servo's CRC.
    parts = f"{len(front) + length + 2}s" + f"{length + 4}s" * (count - 1) + "2x"
    heads = [bytes((0, i)) for i in ids]
    heads[0] = front + heads[0]
    return AnswerFrame(heads, "H", parts, _are_chained)


def _are_intact(parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
    return tuple(map(umts, parts)) == checks


def _are_chained(parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
    """Return whether all CRCs of a fast answer are correct, each continued from the previous one.

    The last CRC alone is not enough: it is computed from the bytes on the line, so it is correct
    even if two servos with one id corrupted each other's block.
    """
    return tuple(map(umts, parts, (0, *checks))) == checks


def parse_fast(raw: bytes, ids: Sequence[int], length: int) -> list[Status]:
    """Return the blocks of a fast answer.

    Every block's CRC continues from the previous CRC as sent, so a damaged block does not
    invalidate the next one; but a lost byte shifts all that follow.
    """
    block = length + 4
    front = _HEAD.pack(HEADER, BROADCAST, block * len(ids) + 1, STATUS)
    found, crc = list[Status](), umts(front)
    at = raw.find(front) + len(front)
    if at < len(front):
        return []
    for servo_id in ids:
        part = raw[at : at + block]
        if len(part) < block:
            break
        sent = int.from_bytes(part[-2:], "little")
        intact = umts(part[:-2], crc) == sent and part[1] == servo_id
        found.append(Status(servo_id, part[0], part[2:-2], intact))
        crc, at = umts(part[-2:], sent), at + block
    return found


def _end(raw: bytes, at: int) -> int | None:
    """Return the end of the status that starts at ``at``, None if no status does."""
    if len(raw) - at < STATUS_OVERHEAD or raw[at + 7] != STATUS:
        return None
    length = int.from_bytes(raw[at + 5 : at + 7], "little")
    return at + 7 + length if 4 <= length <= LONGEST_STATUS else None

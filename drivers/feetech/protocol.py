"""Packets of the Feetech STS servos as bytes: build instructions, parse statuses.

instruction FF FF | id | length | instruction | params | checksum status FF FF | id | length | error
| params | checksum length counts the bytes after it; checksum is the inverse of the sum from the id
to the last param. A status has the form of an instruction, so the echo of a request may look like
an answer.

Source: Feetech, communication protocol of the SCS and STS series.
"""

import struct
from collections.abc import Sequence
from typing import Literal
from zlib import adler32

from gazerig.drivers.servo_bus.family import READ, AnswerFrame, Identity, Status

HEADER = b"\xff\xff"

STATUS_OVERHEAD = 6
"""Bytes of a status in addition to its params."""

REFUSAL = 0
"""No bit of the error byte reports a rejected instruction; all report faults of the servo."""

ALERT = 0xFF
"""Bits of the error byte that report a fault of the servo."""

IDENTITY_LENGTH = 9
"""Registers 0..8: firmware, model, id, baud rate, return delay, status level."""

SCS_SERIES = 5
"""First byte of the model number (3) of servos with the high byte first."""

LONGEST_STATUS = 128
"""Longest possible status; a larger length is noise."""


def instruction(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """Build an instruction packet.

    Raises:
        ValueError: the params are too many for one packet.
    """
    if len(params) > 253:
        raise ValueError(
            f"{len(params)} bytes do not fit into one packet: read fewer servos at once"
        )
    body = bytes((servo_id, len(params) + 2, code)) + params
    return HEADER + body + bytes((checksum(body),))


def checksum(body: bytes) -> int:
    """Return the checksum over the bytes from the id to the last param."""
    return ~sum(body) & 0xFF


number = struct.Struct("B").pack
"""Returns the byte for an address or a number of bytes."""


def identity_request(servo_id: int) -> bytes:
    """Build a read of the first registers, which contain model and firmware."""
    return instruction(servo_id, READ, number(0) + number(IDENTITY_LENGTH))


def parse_identity(status: Status) -> Identity | None:
    """Return model and firmware from the first registers, None if the status contains others.

    The firmware is 100 times the major version plus the minor version, 310 for 3.10. The model
    number of an SCS servo has the high byte first.
    """
    data = status.params
    if len(data) != IDENTITY_LENGTH or data[5] != status.id:
        return None
    order: Literal["little", "big"] = "big" if data[3] == SCS_SERIES else "little"
    return Identity(int.from_bytes(data[3:5], order), 100 * data[0] + data[1])


def parse_statuses(raw: bytes) -> list[Status]:
    """Return every complete status packet in received bytes; skip noise and fragments.

    The checksum sometimes matches if a byte is lost and the next header takes its place. Such a
    status overlaps the next one, so overlapping statuses with correct checksums count as damaged.
    """
    found: list[tuple[int, int, Status]] = []
    at = _header(raw, 0)
    while at >= 0:
        end = at + 4 + raw[at + 3] if len(raw) - at >= STATUS_OVERHEAD else len(raw) + 1
        if end <= len(raw) and 2 <= raw[at + 3] <= LONGEST_STATUS:
            intact = checksum(raw[at + 2 : end - 1]) == raw[end - 1]
            found.append((at, end, Status(raw[at + 2], raw[at + 4], raw[at + 5 : end - 1], intact)))
        at = _header(raw, at + 1)
    intact_spans = [(at, end) for at, end, status in found if status.intact]
    kept = []
    for at, end, status in found:
        if all(span == (at, end) or end <= span[0] or span[1] <= at for span in intact_spans):
            kept.append(status)
        elif status.intact:
            kept.append(status._replace(intact=False))
    return kept


def answer_frame(ids: Sequence[int], length: int, fast: bool) -> AnswerFrame:
    """Return the frame of the answer to a sync read of ``length`` bytes; ``fast``: not known."""
    heads = [HEADER + bytes((servo_id, length + 2, 0)) for servo_id in ids]
    return AnswerFrame(heads, "B", f"2x{length + 4}s" * len(ids), _are_intact)


def _are_intact(parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
    """Return whether the checksums of statuses are correct, from the id to the checksum of each.

    A checksum is the inverse of the preceding sum, so they add up to 0xFF. The lower half of
    Adler-32 is the sum plus 1, and is computed nine times as fast.
    """
    return not any(map((0xFF).__and__, map(adler32, parts)))


def _header(raw: bytes, start: int) -> int:
    """Return the position of the next header, the last FF FF of a row; -1 if there is none."""
    at = raw.find(HEADER, start)
    while 0 <= at < len(raw) - 2 and raw[at + 2] == 0xFF:
        at = raw.find(HEADER, at + 1)
    return at

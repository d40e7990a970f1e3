"""Group reads of current, velocity and position, with everything fixed beforehand.

A plain group is answered by one status a servo, a fast group by one packet in which
every servo's block ends with the CRC over all bytes since the header. Where the whole
answer is right, one unpacking gives all values; otherwise what can be proved right is
taken out piece by piece, so that a bad servo costs only itself.

A group may start its reading a few registers early. An answer that comes too late then
has another length than the one waited for now and cannot be taken for it.
"""

import struct
from collections.abc import Collection, Sequence
from typing import NamedTuple

from fastcrc.crc16 import umts

from drivers.dynamixel_packets import (
    BROADCAST,
    ERROR_NUMBER,
    HEADER,
    STATUS,
    STATUS_OVERHEAD,
    bytes_missing,
    statuses,
    sync_read,
)

FROM, END = 126, 136
"""Present Current (126, 2 bytes), Velocity (128, 4) and Position (132, 4)."""

STARTS = (126, 124, 122, 120)
"""Addresses a reading may start at: the registers before 126 are live values as well."""

_VALUES = struct.Struct("<hii")


class Columns(NamedTuple):
    """Answers of a whole group, in the order of its ids and in register units."""

    errors: tuple[int, ...]
    currents: tuple[int, ...]
    velocities: tuple[int, ...]
    positions: tuple[int, ...]


class Answer(NamedTuple):
    """One servo's answer in register units."""

    error: int
    current: int
    velocity: int
    position: int


class Pieces(NamedTuple):
    """What could be saved of an answer: proved values, and servos whose bytes were damaged."""

    answers: dict[int, Answer]
    damaged: frozenset[int]


class PlainGroup:
    """A sync read: one status a servo."""

    def __init__(self, ids: Sequence[int], start: int) -> None:
        self.ids = tuple(ids)
        self._length = END - start
        self._size = self._length + STATUS_OVERHEAD
        self.request = sync_read(ids, start, self._length)
        self.reply_length = self._size * len(ids)
        self._layout = struct.Struct("<" + f"8sB{FROM - start}xhiiH" * len(ids))
        self._heads = tuple(
            struct.pack("<4sBHB", HEADER, servo_id, self._length + 4, STATUS) for servo_id in ids
        )

    def whole(self, raw: bytes) -> Columns | None:
        """Give all values, None where anything at all is not as it should be."""
        if len(raw) != self.reply_length:
            return None
        values = self._layout.unpack(raw)
        if values[0::6] != self._heads:
            return None
        size = self._size
        for i, crc in enumerate(values[5::6]):
            if umts(raw[i * size : (i + 1) * size - 2]) != crc:
                return None
        return Columns(values[1::6], values[2::6], values[3::6], values[4::6])

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        return bytes_missing(raw, len(self.ids), self._length)

    def pieces(self, raw: bytes) -> Pieces:
        """Save what can be proved right."""
        answers: dict[int, Answer] = {}
        damaged: set[int] = set()
        for status in statuses(raw):
            if status.id not in self.ids:
                continue
            if not status.intact:
                damaged.add(status.id)
            elif len(status.params) == self._length:
                answers[status.id] = Answer(status.error, *_values(status.params))
            elif not status.params and status.error & ERROR_NUMBER:
                answers[status.id] = Answer(status.error, 0, 0, 0)
        return Pieces(answers, frozenset(damaged - answers.keys()))


class FastGroup:
    """A fast sync read: one packet for all."""

    def __init__(self, ids: Sequence[int], start: int) -> None:
        self.ids = tuple(ids)
        self._length = END - start
        self._block = self._length + 4
        self.request = sync_read(ids, start, self._length, fast=True)
        size = self._block * len(ids)
        self._head = struct.pack("<4sBHB", HEADER, BROADCAST, size + 1, STATUS)
        self.reply_length = len(self._head) + size
        self._layout = struct.Struct("<8s" + f"BB{FROM - start}xhiiH" * len(ids))

    def whole(self, raw: bytes) -> Columns | None:
        """Give all values, None where anything at all is not as it should be."""
        if len(raw) != self.reply_length:
            return None
        values = self._layout.unpack(raw)
        # The last CRC covers every byte before it, inner CRCs included.
        if values[0] != self._head or values[2::6] != self.ids or umts(raw[:-2]) != values[-1]:
            return None
        return Columns(values[1::6], values[3::6], values[4::6], values[5::6])

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        at = max(0, raw.find(self._head))
        return max(0, at + self.reply_length - len(raw))

    def pieces(self, raw: bytes) -> Pieces:
        """Save what can be proved right.

        Every block's CRC continues from the CRC before it as it was sent, so a damaged
        block does not spoil the proof of the next.
        """
        answers: dict[int, Answer] = {}
        damaged: set[int] = set()
        at = raw.find(self._head)
        if at < 0:
            return Pieces(answers, frozenset())
        crc = umts(self._head)
        at += len(self._head)
        for servo_id in self.ids:
            block = raw[at : at + self._block]
            if len(block) < self._block:
                break
            sent = int.from_bytes(block[-2:], "little")
            if umts(block[:-2], crc) == sent and block[1] == servo_id:
                answers[servo_id] = Answer(block[0], *_values(block[2:-2]))
            else:
                damaged.add(servo_id)
            crc = umts(block[-2:], sent)
            at += self._block
        return Pieces(answers, frozenset(damaged))


Group = PlainGroup | FastGroup


def _values(span: bytes) -> tuple[int, int, int]:
    """Give current, velocity and position, which end every span."""
    current, velocity, position = _VALUES.unpack(span[-_VALUES.size :])
    return current, velocity, position


def silent_ones(ids: Sequence[int], heard: Collection[int]) -> tuple[int, ...]:
    """Name the servos that kept silent of their own accord.

    A servo waits for the one before it, so behind the last one heard only the first is
    to blame; what is missing before the last one heard has nobody else to blame.
    """
    missing = [i for i, servo_id in enumerate(ids) if servo_id not in heard]
    last_heard = max((i for i, servo_id in enumerate(ids) if servo_id in heard), default=-1)
    behind = [i for i in missing if i > last_heard][:1]
    return tuple(ids[i] for i in [i for i in missing if i < last_heard] + behind)

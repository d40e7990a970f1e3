"""Group reads with everything fixed beforehand.

A plain group is answered by one status a servo, a fast group by one packet in which
every servo's block ends with the CRC over all bytes since the header. Where the whole
answer is right, one unpacking gives all values; otherwise what can be proved right is
taken out piece by piece, so that a bad servo costs only itself.
"""

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

from fastcrc.crc16 import umts

from gazerig.drivers.dynamixel.protocol import (
    BROADCAST,
    ERROR_NUMBER,
    HEADER,
    STATUS,
    STATUS_OVERHEAD,
    bytes_missing,
    statuses,
    sync_read,
)
from gazerig.drivers.dynamixel.read_windows import Sample, View
from gazerig.drivers.servo_bus.sync_read import Pieces

Values = tuple[Any, ...]
"""All numbers of a whole answer; ``Group.columns`` says which are whose."""


class Columns(NamedTuple):
    """Slices of a whole answer: one number a servo, in the order asked; None where not read."""

    error: slice
    current: slice
    velocity: slice
    position: slice
    torque: slice | None = None
    hardware_error: slice | None = None
    temperature: slice | None = None
    voltage: slice | None = None


class PlainGroup:
    """A sync read: one status a servo."""

    def __init__(self, ids: Sequence[int], view: View) -> None:
        self.ids, self.view = tuple(ids), view
        self._size = view.length + STATUS_OVERHEAD
        self.request = sync_read(ids, view.address, view.length)
        self.reply_length = self._size * len(ids)
        self._layout = struct.Struct("<" + f"8sB{view.layout}H" * len(ids))
        self._heads = tuple(
            struct.pack("<4sBHB", HEADER, servo_id, view.length + 4, STATUS) for servo_id in ids
        )
        self._stride = 3 + len(view.fields)
        self.columns = _columns(1, 2, view, self._stride)

    def whole(self, raw: bytes) -> Values | None:
        """Return all values, None where anything at all is not as it should be."""
        if len(raw) != self.reply_length:
            return None
        values = self._layout.unpack(raw)
        if values[0 :: self._stride] != self._heads:
            return None
        size = self._size
        for i, crc in enumerate(values[self._stride - 1 :: self._stride]):
            if umts(raw[i * size : (i + 1) * size - 2]) != crc:
                return None
        return values

    def each(self, raw: bytes, values: Values) -> dict[int, Sample]:
        """Return a faultless answer servo by servo."""
        return self.pieces(raw).samples

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        count = len(self.ids)
        missing = bytes_missing(raw, count, self.view.length)
        if missing:
            return missing
        # Repeated statuses, and others' than asked for, are not those waited for.
        found, length = statuses(raw), self.view.length
        fits = {s.id for s in found if len(s.params) == length or s.error & ERROR_NUMBER}
        there = len(fits.intersection(self.ids))
        return bytes_missing(raw, len(found) + count - there, length)

    def pieces(self, raw: bytes) -> Pieces[Sample]:
        """Save what can be proved right."""
        samples: dict[int, Sample] = {}
        damaged, twofold = set[int](), set[int]()
        for status in statuses(raw):
            if status.id not in self.ids:
                continue
            if not status.intact:
                damaged.add(status.id)
            elif len(status.params) == self.view.length:
                sample = self.view.sample(status.error, status.params)
                # Twice the same is an echo; two that differ cannot both be this servo's.
                if samples.setdefault(status.id, sample) != sample:
                    twofold.add(status.id)
            elif not status.params and status.error & ERROR_NUMBER:
                samples[status.id] = Sample(status.error, 0, 0, 0)
            else:
                # Whole, but not what was asked for: late, or the servo is out of its mind.
                damaged.add(status.id)
        for servo_id in twofold:
            del samples[servo_id]
        return Pieces(samples, frozenset((damaged | twofold) - samples.keys()))


class FastGroup:
    """A fast sync read: one packet for all."""

    def __init__(self, ids: Sequence[int], view: View) -> None:
        self.ids, self.view = tuple(ids), view
        self._block = view.length + 4
        self.request = sync_read(ids, view.address, view.length, fast=True)
        size = self._block * len(ids)
        self._head = struct.pack("<4sBHB", HEADER, BROADCAST, size + 1, STATUS)
        self.reply_length = len(self._head) + size
        self._layout = struct.Struct("<8s" + f"BB{view.layout}H" * len(ids))
        # From each CRC, or the header, up to the next CRC.
        ends = [len(self._head) + self._block * (k + 1) - 2 for k in range(len(ids))]
        self._parts = [slice(start, end) for start, end in zip([0, *ends[:-1]], ends, strict=True)]
        self._stride = 3 + len(view.fields)
        self.columns = _columns(1, 3, view, self._stride)

    def whole(self, raw: bytes) -> Values | None:
        """Return all values, None where anything at all is not as it should be."""
        if len(raw) != self.reply_length:
            return None
        values = self._layout.unpack(raw)
        if values[0] != self._head or values[2 :: self._stride] != self.ids:
            return None
        # The last CRC alone proves too little: it is made of the bytes as they were on the
        # line, so it is right even where two servos with one id spoilt each other's block.
        crc = 0
        for part, sent in zip(self._parts, values[self._stride :: self._stride], strict=True):
            crc = umts(raw[part], crc)
            if crc != sent:
                return None
        return values

    def each(self, raw: bytes, values: Values) -> dict[int, Sample]:
        """Return a faultless answer servo by servo."""
        return self.pieces(raw).samples

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        at = raw.find(self._head)
        if at < 0:
            # An answer of another length is one of before, and stands in front of ours.
            at = _past_packet(raw)
        return max(0, at + self.reply_length - len(raw))

    def pieces(self, raw: bytes) -> Pieces[Sample]:
        """Save what can be proved right.

        Every block's CRC continues from the CRC before it as it was sent, so a damaged
        block does not spoil the proof of the next. Of several damaged in a row the first
        is to blame: a lost byte moves all that follows, a spoilt CRC spoils the next proof.
        """
        samples: dict[int, Sample] = {}
        damaged, unproved = set[int](), set[int]()
        at = raw.find(self._head)
        if at < 0:
            return Pieces(samples, frozenset())
        crc = umts(self._head)
        at += len(self._head)
        well = True
        for i, servo_id in enumerate(self.ids):
            block = raw[at : at + self._block]
            if len(block) < self._block:
                unproved.update(() if well else self.ids[i:])
                break
            sent = int.from_bytes(block[-2:], "little")
            if umts(block[:-2], crc) == sent and block[1] == servo_id:
                samples[servo_id] = self.view.sample(block[0], block[2:-2])
                well = True
            else:
                (damaged if well else unproved).add(servo_id)
                well = False
            crc = umts(block[-2:], sent)
            at += self._block
        return Pieces(samples, frozenset(damaged), frozenset(unproved))


Group = PlainGroup | FastGroup

_OTHERS = HEADER + bytes((BROADCAST,))


def _past_packet(raw: bytes) -> int:
    """Return where a packet of all that stands in front ends, 0 where none does."""
    if not raw.startswith(_OTHERS) or len(raw) < len(_OTHERS) + 2:
        return 0
    length = int.from_bytes(raw[5:7], "little")
    return 7 + length if length <= _LONGEST else 0


_LONGEST = 2048
"""Length of a fast answer of more servos than there can be: noise."""


def _columns(error: int, first: int, view: View, stride: int) -> Columns:
    """Return the slices of every field in a tuple of ``stride`` numbers a servo."""
    # A fast answer has one number before the first servo's, a plain one its head.
    named = {name: slice(first + i, None, stride) for i, name in enumerate(view.fields)}
    return Columns(slice(error, None, stride), **named)

"""Sync reads with everything fixed beforehand: one status a servo, in the order asked.

Where the whole answer is right, one unpacking gives all values; otherwise what can be proved
right is taken out piece by piece, so that a bad servo costs only itself.
"""

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.read_windows import Columns, ReadWindow, Sample

Values = tuple[Any, ...]
"""All numbers of a whole answer; ``columns`` maps them to servos."""


class PartialReply(NamedTuple):
    """What could be saved of an answer.

    samples: proved values by id
    damaged: servos whose bytes were spoilt
    unproved: servos whose bytes cannot be judged because of a damaged one before them
    """

    samples: dict[int, Sample]
    damaged: frozenset[int]
    unproved: frozenset[int] = frozenset()


class GroupRead(Protocol):
    """A read of some servos with everything fixed beforehand."""

    ids: tuple[int, ...]
    columns: Columns
    request: bytes
    reply_length: int

    def whole(self, raw: bytes) -> Values | None:
        """Return all values, None where anything at all is not as it should be."""

    def missing(self, raw: bytes) -> int:
        """Return how many bytes are still to come."""

    def pieces(self, raw: bytes) -> PartialReply:
        """Return what can be proved right."""


class SyncRead:
    """A sync read, one status a servo; of one servo a plain read where there is no other.

    See ``GroupRead``.
    """

    def __init__(self, family: Family, ids: Sequence[int], window: ReadWindow) -> None:
        codec = self._codec = family.codec
        self.ids, self.window = tuple(ids), window
        self._size = window.length + codec.STATUS_OVERHEAD
        self.request = family.request(ids, window.address, window.length)
        self.reply_length = self._size * len(ids)
        self._heads = tuple(codec.status_head(i, window.length) for i in ids)
        one = f"{len(codec.status_head(0, 0))}sB{window.layout}{codec.CHECK}"
        self._layout = struct.Struct(window.order + one * len(ids))
        before, after = codec.CHECKED
        part = f"{before}x{self._size - before - after}s{after}x"
        self._parts = struct.Struct(part * len(ids))
        self._stride = 3 + len(window.fields)
        self.columns = window.columns(1, 2, self._stride)

    def whole(self, raw: bytes) -> Values | None:
        """Return all values, None where anything at all is not as it should be."""
        if len(raw) != self.reply_length:
            return None
        values = self._layout.unpack(raw)
        if values[0 :: self._stride] != self._heads:
            return None
        checks = values[self._stride - 1 :: self._stride]
        return values if self._codec.all_intact(self._parts.unpack(raw), checks) else None

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        codec, count, length = self._codec, len(self.ids), self.window.length
        missing = codec.bytes_missing(raw, count, length)
        if missing:
            return missing
        # Repeated statuses, echoes, and others' than asked for, are not those waited for.
        found = codec.statuses(raw)
        fits = {s.id for s in found if len(s.params) == length or s.error & codec.REFUSAL}
        there = len(fits.intersection(self.ids))
        return codec.bytes_missing(raw, len(found) + count - there, length)

    def pieces(self, raw: bytes) -> PartialReply:
        """Return what can be proved right."""
        samples: dict[int, Sample] = {}
        damaged, twofold = set[int](), set[int]()
        for status in self._codec.statuses(raw):
            if status.id not in self.ids:
                continue
            if not status.intact:
                damaged.add(status.id)
            elif len(status.params) == self.window.length:
                sample = self.window.sample(status.error, status.params)
                # Twice the same is an echo; two that differ cannot both be this servo's.
                if samples.setdefault(status.id, sample) != sample:
                    twofold.add(status.id)
            elif not status.params and status.error & self._codec.REFUSAL:
                samples[status.id] = Sample(status.error)
            else:
                # GroupReply, but not what was asked for: late, or the servo is out of its mind.
                damaged.add(status.id)
        for servo_id in twofold:
            del samples[servo_id]
        return PartialReply(samples, frozenset((damaged | twofold) - samples.keys()))

"""Group reads with everything fixed beforehand: one status a servo, in the order asked.

Where the whole answer is right every servo's bytes are at their place; otherwise what can
be proved right is taken out piece by piece, so that a bad servo costs only itself.
"""

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

from gazerig.drivers.feetech.protocol import (
    HEADER,
    STATUS_OVERHEAD,
    bytes_missing,
    statuses,
    sync_read,
)
from gazerig.drivers.feetech.views import Sample, View
from gazerig.drivers.servo_bus.sync_read import Pieces

Values = tuple[Any, ...]
"""All numbers of a whole answer; ``Group.columns`` says which are whose."""


class Columns(NamedTuple):
    """Slices of a whole answer: one number a servo, in the order asked, signs not decoded."""

    error: slice
    position: slice
    velocity: slice
    load: slice
    voltage: slice
    temperature: slice
    status: slice
    moving: slice
    current: slice


class Group:
    """A sync read of some servos."""

    def __init__(self, ids: Sequence[int], view: View) -> None:
        self.ids, self.view = tuple(ids), view
        self._size = view.length + STATUS_OVERHEAD
        self.request = sync_read(ids, view.address, view.length)
        self.reply_length = self._size * len(ids)
        self._heads = tuple(HEADER + bytes((i, view.length + 2)) for i in ids)
        self._layout = struct.Struct("<" + f"4sB{view.layout}B" * len(ids))
        self._stride = 3 + view.numbers
        self._spans = [slice(k * self._size + 2, (k + 1) * self._size) for k in range(len(ids))]
        self.columns = Columns(
            slice(1, None, self._stride),
            *(slice(view.numbers - 6 + i, None, self._stride) for i in range(8)),
        )

    def whole(self, raw: bytes) -> Values | None:
        """Return all values, None where anything at all is not as it should be."""
        if len(raw) != self.reply_length:
            return None
        values = self._layout.unpack(raw)
        if values[0 :: self._stride] != self._heads:
            return None
        for span in self._spans:
            # From the id to the check byte, which is the inverse of the sum before it.
            if sum(raw[span]) & 0xFF != 0xFF:
                return None
        return values

    def each(self, raw: bytes, values: Values) -> dict[int, Sample]:
        """Return a faultless answer servo by servo."""
        size = self._size
        return {
            servo_id: self.view.sample(raw[k * size + 4], raw[k * size + 5 : (k + 1) * size - 1])
            for k, servo_id in enumerate(self.ids)
        }

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        count, length = len(self.ids), self.view.length
        missing = bytes_missing(raw, count, length)
        if missing:
            return missing
        # Repeated statuses, echoes, and others' than asked for, are not those waited for.
        found = statuses(raw)
        there = {s.id for s in found if len(s.params) == length}.intersection(self.ids)
        return bytes_missing(raw, len(found) + count - len(there), length)

    def pieces(self, raw: bytes) -> Pieces[Sample]:
        """Save what can be proved right."""
        samples: dict[int, Sample] = {}
        damaged, twofold = set[int](), set[int]()
        for status in statuses(raw):
            if status.id not in self.ids:
                continue
            if not status.intact or len(status.params) != self.view.length:
                # Spoilt; or whole, but not what was asked for: late, or out of its mind.
                damaged.add(status.id)
                continue
            sample = self.view.sample(status.error, status.params)
            # Twice the same is an echo; two that differ cannot both be this servo's.
            if samples.setdefault(status.id, sample) != sample:
                twofold.add(status.id)
        for servo_id in twofold:
            del samples[servo_id]
        return Pieces(samples, frozenset((damaged | twofold) - samples.keys()))

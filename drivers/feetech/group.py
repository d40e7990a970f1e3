"""Group reads with everything fixed beforehand: one status a servo, in the order asked.

Where the whole answer is right every servo's bytes are at their place; otherwise what can
be proved right is taken out piece by piece, so that a bad servo costs only itself.
"""

from collections.abc import Sequence

from drivers.feetech.protocol import (
    HEADER,
    STATUS_OVERHEAD,
    bytes_missing,
    checksum,
    statuses,
    sync_read,
)
from drivers.feetech.views import Sample, View
from drivers.servo_bus.sync_read import Pieces


class Group:
    """A sync read of some servos."""

    def __init__(self, ids: Sequence[int], view: View) -> None:
        self.ids, self.view = tuple(ids), view
        self._size = view.length + STATUS_OVERHEAD
        self.request = sync_read(ids, view.address, view.length)
        self.reply_length = self._size * len(ids)
        self._heads = tuple(HEADER + bytes((i, view.length + 2)) for i in ids)

    def whole(self, raw: bytes) -> dict[int, Sample] | None:
        """Give everybody's values, None where anything at all is not as it should be."""
        size, samples = self._size, dict[int, Sample]()
        if len(raw) != self.reply_length:
            return None
        for k, servo_id in enumerate(self.ids):
            status = raw[k * size : (k + 1) * size]
            if status[:4] != self._heads[k] or checksum(status[2:-1]) != status[-1]:
                return None
            samples[servo_id] = self.view.sample(status[4], status[5:-1])
        return samples

    def each(self, raw: bytes, values: dict[int, Sample]) -> dict[int, Sample]:
        """Return a faultless answer servo by servo."""
        return values

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

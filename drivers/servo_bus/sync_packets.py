"""Sync reads with everything fixed beforehand: one status a servo, in the order asked.

Where the whole answer is right and no servo has anything to report, one comparison and one
unpacking give all values; otherwise what can be proved right is taken out piece by piece, so that a
bad servo costs only itself.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.read_windows import KNOWN, Columns, ReadWindow, Sample

Values = tuple[Any, ...]
"""The measured numbers of a whole answer; ``columns`` maps them to servos."""

Expected = Mapping[str, Sequence[int | None]]
"""Known fields of the answers of healthy servos, a value a servo; None: anything will do."""


class PartialReply(NamedTuple):
    """What could be saved of an answer.

    samples: proved values by id
    damaged: servos whose bytes were spoilt
    unproved: servos whose bytes cannot be judged because of a damaged one before them
    stray: bytes came that are of no right answer, and an answer is missing
    """

    samples: dict[int, Sample]
    damaged: frozenset[int]
    unproved: frozenset[int] = frozenset()
    stray: bool = False


class GroupRead(Protocol):
    """A read of some servos with everything fixed beforehand."""

    ids: tuple[int, ...]
    window: ReadWindow
    columns: Columns
    request: bytes
    reply_length: int
    covers_torque: bool

    @property
    def whole(self) -> "Callable[[bytes, Expected], Values | None]":
        """Return ``WholeAnswer.values`` of its answer."""

    def missing(self, raw: bytes) -> int:
        """Return how many bytes are still to come."""

    def pieces(self, raw: bytes) -> PartialReply:
        """Return what can be proved right."""


class WholeAnswer:
    """The bytes of an answer of all servos, in which each has an error byte of 0 and no news.

    Most of these bytes are known beforehand: heads, ids, errors, torque, limits. They are compared
    all at once, as one number under a mask; only the others are unpacked.

    Args:
        front: bytes before those of the first servo.
        heads: of each servo, the error byte among them.
        window: what follows a head.
        check: struct code of the check at the end of each servo's bytes.
        parts: struct codes of what is under the checks.
        intact: whether checks are right, from what is under them and the checks.

    length: of the answer
    columns: where the measured values are
    """

    def __init__(
        self,
        front: bytes,
        heads: Sequence[bytes],
        window: ReadWindow,
        check: str,
        parts: str,
        intact: Callable[[tuple[bytes, ...], tuple[int, ...]], bool],
    ) -> None:
        self._front, self._heads, self._window, self._check = front, heads, window, check
        order, one = window.order, f"{len(heads[0])}x"
        for code, name in window.codes():
            one += f"{struct.calcsize(order + code)}x" if name in KNOWN else code
        layout = struct.Struct(f"{order}{len(front)}x" + (one + check) * len(heads))
        stride = len(window.measured()) + 1
        self.length, self._unpack = layout.size, layout.unpack
        self.columns, self._checks = window.columns(stride), slice(stride - 1, None, stride)
        self._parts, self._intact = struct.Struct(parts).unpack, intact
        self._expected: Expected | None = None
        self._mask = self._known = 0

    def values(self, raw: bytes, expected: Expected) -> Values | None:
        """Return all measured values, None where anything at all is not as it should be.

        Args:
            raw: the answer.
            expected: what servos answer that are as they were left; the same mapping where nothing
                has changed.
        """
        if expected is not self._expected:
            self._expect(expected)
        if len(raw) != self.length or int.from_bytes(raw, "little") & self._mask != self._known:
            return None
        values = self._unpack(raw)
        return values if self._intact(self._parts(raw), values[self._checks]) else None

    def _expect(self, expected: Expected) -> None:
        """Compare with these values of known fields from now on; a status is always 0."""
        self._expected = expected
        order, expected = self._window.order, {"status": (0,) * len(self._heads), **expected}
        mask, known = [b"\xff" * len(self._front)], [self._front]
        for k, head in enumerate(self._heads):
            mask.append(b"\xff" * len(head))
            known.append(head)
            for code, name in (*self._window.codes(), (self._check, "")):
                value = expected[name][k] if name in expected else None
                size = struct.calcsize(order + code)
                mask.append((b"\x00" if value is None else b"\xff") * size)
                known.append(bytes(size) if value is None else struct.pack(order + code, value))
        self._mask = int.from_bytes(b"".join(mask), "little")
        self._known = int.from_bytes(b"".join(known), "little")


class SyncRead:
    """A sync read, one status a servo; of one servo a plain read where there is no other.

    See ``GroupRead``.
    """

    def __init__(self, family: Family, ids: Sequence[int], window: ReadWindow) -> None:
        codec = self._codec = family.codec
        self.ids, self.window = tuple(ids), window
        self._size = window.length + codec.STATUS_OVERHEAD
        self.request = family.request(ids, window.address, window.length)
        heads = [codec.status_head(i, window.length) + b"\x00" for i in ids]
        before, after = codec.CHECKED
        part = f"{before}x{self._size - before - after}s{after}x"
        answer = WholeAnswer(b"", heads, window, codec.CHECK, part * len(ids), codec.all_intact)
        self.whole, self.columns = answer.values, answer.columns
        self.reply_length, self.covers_torque = answer.length, "torque" in window.fields

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
        """Return what can be proved right.

        Servos answer in the order asked. Where an answer is missing, one in the place of another
        servo's proves nothing: that servo may have lost its id, and the right answer its header.
        """
        samples: dict[int, Sample] = {}
        damaged, twofold, in_place = set[int](), set[int](), set[int]()
        begin = len(self.request) if raw.startswith(self.request) else 0  # an echo
        stray = len(raw)
        for status in self._codec.statuses(raw):
            stray -= status.intact * (len(status.params) + self._codec.STATUS_OVERHEAD)
            if status.id not in self.ids:
                continue
            place = begin + self.ids.index(status.id) * self._size
            if status.intact and abs(status.at - place) < self._size // 2:
                in_place.add(status.id)
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
                # An answer, but not what was asked for: late, or the servo is out of its mind.
                damaged.add(status.id)
        missing = len(samples) < len(self.ids)
        unproved = samples.keys() - in_place if missing else set[int]()
        for servo_id in twofold | unproved:
            del samples[servo_id]
        damaged = (damaged | twofold) - samples.keys()
        return PartialReply(
            samples, frozenset(damaged), frozenset(unproved - damaged), missing and stray > 0
        )

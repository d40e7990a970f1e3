"""Sync reads with everything fixed beforehand: one status a servo, in the order asked.

Where the whole answer is right and no servo has anything to report, one comparison and one
unpacking give all values; otherwise what can be proved right is taken out piece by piece, so that a
bad servo costs only itself.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

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

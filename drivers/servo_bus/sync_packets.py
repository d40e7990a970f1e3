"""Prepared sync reads: one status per servo, in the order of the request.

If the whole answer is intact and no servo reports an error, one comparison and one unpacking return
all values. Otherwise the parts that can be verified are extracted one by one, so that a faulty
servo affects only itself.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from gazerig.drivers.servo_bus.read_windows import KNOWN, Columns, ReadWindow, Sample

Values = tuple[Any, ...]
"""The measured numbers of a whole answer; ``columns`` maps them to servos."""

Expected = Mapping[str, Sequence[int | None]]
"""Known fields of the answers of healthy servos, one value per servo; None accepts any value."""


class PartialReply(NamedTuple):
    """Verified parts of an answer.

    samples: verified values by id
    damaged: servos whose bytes were damaged
    unproved: servos whose bytes cannot be verified because of a damaged answer before them
    stray: whether an answer is missing and bytes arrived that belong to no valid answer
    """

    samples: dict[int, Sample]
    damaged: frozenset[int]
    unproved: frozenset[int] = frozenset()
    stray: bool = False


class GroupRead(Protocol):
    """A prepared read of some servos."""

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
        """Return how many bytes have not arrived yet."""

    def pieces(self, raw: bytes) -> PartialReply:
        """Return the verified parts."""


class WholeAnswer:
    """Expected bytes of an answer of all servos without errors.

    Most of these bytes are known in advance: headers, ids, errors, torque, limits. They are
    compared together, as one number under a mask; only the others are unpacked.

    Args:
        front: Bytes before those of the first servo.
        heads: Header of each servo's bytes, including the error byte.
        window: Registers after a header.
        check: Struct code of the checksum at the end of each servo's bytes.
        parts: Struct codes of the parts that the checksums cover.
        intact: Returns whether checksums match, from the covered parts and the checksums.

    length: number of bytes of the answer
    columns: slices of the measured values
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
        """Return all measured values, None if any byte differs from the expected ones.

        Args:
            raw: Bytes of the answer.
            expected: Expected values of servos in their last known state; the same mapping object
                if nothing has changed.
        """
        if expected is not self._expected:
            self._expect(expected)
        if len(raw) != self.length or int.from_bytes(raw, "little") & self._mask != self._known:
            return None
        values = self._unpack(raw)
        return values if self._intact(self._parts(raw), values[self._checks]) else None

    def _expect(self, expected: Expected) -> None:
        """Set the expected values of known fields; a status is always 0."""
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

"""Plan of the reads of a bus, created by the family once the servos' firmware is known."""

import re
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

CALM_S = 0.25
"""Time after the last trouble beyond which no answer is late any more."""

KNOWN = ("torque", "status", "acceleration", "torque_limit")
"""Fields with known values in a healthy servo: no fault, the others as last written."""


class Sample(NamedTuple):
    """One servo's answer in register units; None for fields that the read did not cover.

    error: error byte of the answer
    effort: present load or current, depending on the servo
    status: register of the servo's faults
    acceleration, torque_limit: values written before torque was switched on
    is_blank: whether every byte is zero, as in an indirect block whose addresses are lost
    """

    error: int
    position: int = 0
    velocity: int = 0
    effort: int = 0
    torque: int | None = None
    status: int | None = None
    temperature: int | None = None
    voltage: int | None = None
    acceleration: int | None = None
    torque_limit: int | None = None
    is_blank: bool = False


class Columns(NamedTuple):
    """Slices of a complete answer: one number per servo in request order; None if not read."""

    position: slice
    velocity: slice
    effort: slice
    temperature: slice | None = None
    voltage: slice | None = None


class ReadWindow(NamedTuple):
    """Bytes read from every servo: their address and meaning.

    layout: struct codes of all ``length`` bytes; order: byte order of a number
    fields: names of the numbers, as in ``Sample``
    signs: fields with a separate sign bit, and that bit
    """

    address: int
    length: int
    layout: str
    fields: tuple[str, ...]
    order: str = "<"
    signs: tuple[tuple[str, int], ...] = ()

    def sample(self, error: int, data: bytes) -> Sample:
        """Return one servo's numbers from its bytes."""
        values = dict(zip(self.fields, struct.unpack(self.order + self.layout, data), strict=True))
        for name, bit in self.signs:
            values[name] = from_sign_magnitude(values[name], bit)
        return Sample(error, **values, is_blank="torque" in values and not any(data))

    def struct_codes(self) -> Iterator[tuple[str, str]]:
        """Yield the struct code of every number and its field, "" for unused bytes."""
        names = iter(self.fields)
        for code in re.findall(r"\d*x|[a-zA-Z]", self.layout):
            yield code, "" if code.endswith("x") else next(names)

    def measured_fields(self) -> tuple[str, ...]:
        """Return the fields whose values are not known in advance."""
        return tuple(name for name in self.fields if name not in KNOWN)

    def columns(self, stride: int) -> Columns:
        """Return the slices of the measured fields in a tuple of ``stride`` numbers per servo."""
        return Columns(
            **{name: slice(i, None, stride) for i, name in enumerate(self.measured_fields())}
        )


class WindowSchedule:
    """Order of windows: the usual ones in rotation, spare ones for a while after a missing answer.

    An answer contains neither its registers nor the time of its request; only its length identifies
    it. So two consecutive reads never have the same length, and after trouble they have other,
    distinct lengths for a while. A line that repeats its last answer, or delivers it one read too
    late, is therefore not believed.

    Args:
        usual: Windows; neighbours, and the first and last, have different lengths.
        spare: Windows of different lengths; two alternate after each trouble, then the next two.

    is_troubled: whether the spare windows are read
    """

    def __init__(self, usual: Iterable[ReadWindow], spare: Iterable[ReadWindow]) -> None:
        self._usual, self._spare = tuple(usual), tuple(spare)
        self._at, self._pair, self._odd = -1, -2, 0
        self._calm_at_s = 0.0
        self.is_troubled = False

    def next_window(self) -> ReadWindow:
        """Return the window of the next read."""
        if self.is_troubled:
            self._odd ^= 1
            return self._spare[(self._pair + self._odd) % len(self._spare)]
        self._at += 1
        if self._at >= len(self._usual):
            self._at = 0
        return self._usual[self._at]

    def record_trouble(self, now_s: float) -> None:
        """Record that an answer is missing: the next reads have other lengths."""
        self.is_troubled = True
        self._pair, self._odd = (self._pair + 2) % len(self._spare), 1
        self._calm_at_s = now_s + CALM_S

    def end_trouble(self, now_s: float) -> None:
        """Return to the usual windows once no answer can be late any more."""
        if now_s >= self._calm_at_s:
            self.is_troubled = False


def from_sign_magnitude(raw: int, sign: int) -> int:
    """Return the signed value of a magnitude whose sign is in bit ``sign``."""
    magnitude = raw & (1 << sign) - 1
    return -magnitude if raw >> sign & 1 else magnitude


Values = tuple[Any, ...]
"""The measured numbers of a whole answer; ``columns`` maps them to servos."""

Expected = Mapping[str, Sequence[int | None]]
"""Known fields of the answers of healthy servos, one value per servo; None accepts any value."""


class PartialReply(NamedTuple):
    """Verified parts of an answer.

    samples: verified values by id
    damaged: servos whose bytes were damaged
    unverifiable: servos whose bytes cannot be verified because of a damaged answer before them
    has_stray_bytes: whether an answer is missing and bytes arrived that belong to no valid answer
    """

    samples: dict[int, Sample]
    damaged: frozenset[int]
    unverifiable: frozenset[int] = frozenset()
    has_stray_bytes: bool = False


class GroupRead(Protocol):
    """A prepared read of some servos."""

    ids: tuple[int, ...]
    window: ReadWindow
    columns: Columns
    request: bytes
    reply_length: int
    covers_torque: bool

    @property
    def parse_whole(self) -> "Callable[[bytes, Expected], Values | None]":
        """Return ``WholeAnswer.values`` of its answer."""

    def bytes_missing(self, raw: bytes) -> int:
        """Return how many bytes have not arrived yet."""

    def verified_parts(self, raw: bytes) -> PartialReply:
        """Return the verified parts."""


class WholeAnswer:
    """Expected bytes of an answer of all servos without errors.

    If the whole answer is intact and no servo reports an error, one comparison and one unpacking
    return all values. Otherwise the parts that can be verified are extracted one by one, so that a
    faulty servo affects only itself.

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
        for code, name in window.struct_codes():
            one += f"{struct.calcsize(order + code)}x" if name in KNOWN else code
        layout = struct.Struct(f"{order}{len(front)}x" + (one + check) * len(heads))
        stride = len(window.measured_fields()) + 1
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
            # Known fields have expected values; a status is always 0.
            self._expected = expected
            order, expected = self._window.order, {"status": (0,) * len(self._heads), **expected}
            mask, known = [b"\xff" * len(self._front)], [self._front]
            for k, head in enumerate(self._heads):
                mask.append(b"\xff" * len(head))
                known.append(head)
                for code, name in (*self._window.struct_codes(), (self._check, "")):
                    value = expected[name][k] if name in expected else None
                    size = struct.calcsize(order + code)
                    mask.append((b"\x00" if value is None else b"\xff") * size)
                    known.append(bytes(size) if value is None else struct.pack(order + code, value))
            self._mask = int.from_bytes(b"".join(mask), "little")
            self._known = int.from_bytes(b"".join(known), "little")
        if len(raw) != self.length or int.from_bytes(raw, "little") & self._mask != self._known:
            return None
        values = self._unpack(raw)
        return values if self._intact(self._parts(raw), values[self._checks]) else None


class AddressMap(NamedTuple):
    """Addresses that a servo's indirect block must contain, as bytes from ``address`` on."""

    address: int
    data: bytes


class ReadPlan(NamedTuple):
    """Read windows and packets.

    group_windows, single_windows: windows for reads of all servos, and of servos that are read
        alone
    confirming_windows: windows for confirming reads, of other lengths than the first reads
    create_group_read: creates the read of some servos with a window, if it is not a plain sync read
    armed_window: window with torque and limits, to check that a servo is still armed
    covers_torque: whether every read contains torque and faults
    indirect_block: required contents of indirect blocks, None if there are none
    """

    group_windows: WindowSchedule
    single_windows: WindowSchedule
    confirming_windows: WindowSchedule
    create_group_read: Callable[[Sequence[int], ReadWindow], GroupRead] | None = None
    armed_window: ReadWindow | None = None
    covers_torque: bool = True
    indirect_block: AddressMap | None = None

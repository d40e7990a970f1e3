"""Registers that a read covers, byte by byte, and the order of reads.

An answer contains neither its registers nor the time of its request; only its length identifies it.
So two consecutive reads never have the same length, and after trouble they have other, distinct
lengths for a while. A line that repeats its last answer, or delivers it one read too late, is
therefore not believed.
"""

import re
import struct
from collections.abc import Iterable, Iterator
from typing import NamedTuple

CALM_S = 0.25
"""Time after the last trouble beyond which no answer is late any more."""

KNOWN = ("torque", "status", "acceleration", "torque_limit")
"""Fields with known values in a healthy servo: no fault, the others as written."""


class Sample(NamedTuple):
    """One servo's answer in register units; None for fields that the read did not cover.

    error: error byte of the answer
    effort: present load or current, depending on the servo
    status: register of the servo's faults
    acceleration, torque_limit: values written before torque was switched on
    blank: whether every byte is zero, as in an indirect block whose addresses are lost
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
    blank: bool = False


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
        return Sample(error, **values, blank="torque" in values and not any(data))

    def codes(self) -> Iterator[tuple[str, str]]:
        """Yield the struct code of every number and its field, "" for unused bytes."""
        names = iter(self.fields)
        for code in re.findall(r"\d*x|[a-zA-Z]", self.layout):
            yield code, "" if code.endswith("x") else next(names)

    def measured(self) -> tuple[str, ...]:
        """Return the fields whose values are not known in advance."""
        return tuple(name for name in self.fields if name not in KNOWN)

    def columns(self, stride: int) -> Columns:
        """Return the slices of the measured fields in a tuple of ``stride`` numbers per servo."""
        return Columns(**{name: slice(i, None, stride) for i, name in enumerate(self.measured())})


class WindowSchedule:
    """Order of windows: the usual ones in rotation, spare ones for a while after a missing answer.

    Args:
        usual: Windows; neighbours, and the first and last, have different lengths.
        spare: Windows of different lengths; two alternate after each trouble, then the next two.

    troubled: whether the spare windows are read
    """

    def __init__(self, usual: Iterable[ReadWindow], spare: Iterable[ReadWindow]) -> None:
        self._usual, self._spare = tuple(usual), tuple(spare)
        self._at, self._pair, self._odd = -1, -2, 0
        self._calm_at_s = 0.0
        self.troubled = False

    def next(self) -> ReadWindow:
        """Return the window of the next read."""
        if self.troubled:
            self._odd ^= 1
            return self._spare[(self._pair + self._odd) % len(self._spare)]
        self._at += 1
        if self._at >= len(self._usual):
            self._at = 0
        return self._usual[self._at]

    def record_trouble(self, now_s: float) -> None:
        """Record that an answer is missing: the next reads have other lengths."""
        self.troubled = True
        self._pair, self._odd = (self._pair + 2) % len(self._spare), 1
        self._calm_at_s = now_s + CALM_S

    def end_trouble(self, now_s: float) -> None:
        """Return to the usual windows once no answer can be late any more."""
        if now_s >= self._calm_at_s:
            self.troubled = False


def from_sign_magnitude(raw: int, sign: int) -> int:
    """Return the signed value of a magnitude whose sign is in bit ``sign``."""
    magnitude = raw & (1 << sign) - 1
    return -magnitude if raw >> sign & 1 else magnitude

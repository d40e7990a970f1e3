"""Which registers one reading covers, byte by byte, and which reading comes next.

An answer says neither which registers it is of nor when it was asked for; its length is all
there is to tell it by. So two readings in a row never have the same length, and after trouble
they have other lengths for a while, each its own: a line that says its last answer again, or
one answer too late, is not taken at its word.
"""

import re
import struct
from collections.abc import Iterable, Iterator
from typing import NamedTuple

CALM_S = 0.25
"""So long after the last trouble no answer is late any more."""

KNOWN = ("torque", "status", "acceleration", "torque_limit")
"""Fields whose values are known of a healthy servo: no fault, the rest as it was written."""


class Sample(NamedTuple):
    """One servo's answer in register units; None where the reading did not cover it.

    error: error byte of the answer
    effort: present load or current, whichever the servo measures
    status: the register that has what ails the servo
    acceleration, torque_limit: as they were written before the torque came on
    blank: every byte is zero, as in an indirect block whose addresses are lost
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
    """Slices of a whole answer: one number a servo, in the order asked; None where not read."""

    position: slice
    velocity: slice
    effort: slice
    temperature: slice | None = None
    voltage: slice | None = None


class ReadWindow(NamedTuple):
    """Bytes read from every servo: where they are, and what they mean.

    layout: struct codes of all ``length`` bytes; order: of the bytes of a number
    fields: names of the numbers, as in ``Sample``
    signs: fields whose sign is a bit of its own, and that bit
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
        """Yield the struct code of every number and its field, "" for bytes without a meaning."""
        names = iter(self.fields)
        for code in re.findall(r"\d*x|[a-zA-Z]", self.layout):
            yield code, "" if code.endswith("x") else next(names)

    def measured(self) -> tuple[str, ...]:
        """Return the fields of which no servo's answer is known beforehand."""
        return tuple(name for name in self.fields if name not in KNOWN)

    def columns(self, stride: int) -> Columns:
        """Return the slices of the measured fields in a tuple of ``stride`` numbers a servo."""
        return Columns(**{name: slice(i, None, stride) for i, name in enumerate(self.measured())})


class WindowSchedule:
    """Chooses the next window: the usual ones in turn, after a missing answer others for a while.

    Args:
        usual: neighbours, and the first and last, have different lengths.
        spare: no two alike; two of them take turns after each trouble, then the next two.

    troubled: whether the spare ones are read
    """

    def __init__(self, usual: Iterable[ReadWindow], spare: Iterable[ReadWindow]) -> None:
        self._usual, self._spare = tuple(usual), tuple(spare)
        self._at, self._pair, self._odd = -1, -2, 0
        self._calm_at_s = 0.0
        self.troubled = False

    def next(self) -> ReadWindow:
        """Return the window of the next reading."""
        if self.troubled:
            self._odd ^= 1
            return self._spare[(self._pair + self._odd) % len(self._spare)]
        self._at += 1
        if self._at >= len(self._usual):
            self._at = 0
        return self._usual[self._at]

    def trouble(self, now_s: float) -> None:
        """Record that an answer stayed out: the next readings have other lengths."""
        self.troubled = True
        self._pair, self._odd = (self._pair + 2) % len(self._spare), 1
        self._calm_at_s = now_s + CALM_S

    def calm(self, now_s: float) -> None:
        """Return to the usual windows when nothing can be late any more."""
        if now_s >= self._calm_at_s:
            self.troubled = False


def from_sign_magnitude(raw: int, sign: int) -> int:
    """Return the number that a magnitude with its sign in bit ``sign`` stands for."""
    magnitude = raw & (1 << sign) - 1
    return -magnitude if raw >> sign & 1 else magnitude

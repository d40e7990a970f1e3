"""Observers of every tick, and the stream of ticks to other processes.

The stream is encoded in batches, once for all receivers.

If each tick is encoded at its end, neither code nor encoder are in the processor's cache; a
batch several times per second takes a third of that time. MessagePack keeps every number bit for
bit.
"""

import re
from collections.abc import Callable
from math import inf
from typing import Any, Generic, NamedTuple, TypeVar

import msgspec
import numpy as np
from msgspec import UNSET, UnsetType
from msgspec.structs import replace

from gazerig.gaze.types import Percept
from gazerig.robot.loop.tick import BodyRecord, Tick, TickRecord

T = TypeVar("T")
LIVE_S = 0.0399  # slightly below 40 ms, so that rounding does not make it 45
"""Time between two batches of a run in real time."""
SIMULATED_S = 0.2
"""Time between two batches in simulated time, without viewers."""


class Observers(Generic[T]):
    """Functions that are called with every value; a function that raises is removed.

    Args:
        report: Receives one line about each removed function.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._observers: dict[str, Callable[[T], object]] = {}

    def __bool__(self) -> bool:
        """Return whether there is any."""
        return bool(self._observers)

    def add(self, name: str, update: Callable[[T], object]) -> None:
        """Add a function under a name for messages."""
        self._observers = {**self._observers, name: update}

    def update(self, value: T) -> list[object]:
        """Call all functions with a value, such as a tick; return their results."""
        results = []
        for name, update in tuple(self._observers.items()):
            try:
                results.append(update(value))
            except Exception as error:
                del self._observers[name]
                self._report(failure_text(name, error))
        return results


def failure_text(name: str, error: Exception) -> str:
    """Return a message that the run continues without a failed observer."""
    what = " ".join(str(error).split())
    why = f"{type(error).__name__}: {what}" if what else type(error).__name__
    return f"{name} failed ({why}); the rig continues without it"


class TickBatch(NamedTuple):
    """A batch of ticks in the order of time.

    Attributes:
        data: A list of ``TickRecord``.
        ticks: Number of ticks.
        newest: The last tick.
    """

    data: bytes
    ticks: int
    newest: Tick


class TickStream:
    """A stream of ticks in batches; used only in the loop's thread.

    Attributes:
        sinks: Receive each batch; one returns False if it loses a batch.

    Args:
        report: Receives one line about each sink that fails and is removed.
        every_s: Time between two batches.
    """

    def __init__(self, report: Callable[[str], None], every_s: float = LIVE_S) -> None:
        self._every_s = every_s
        self.sinks = Observers[TickBatch](report)
        self._records: list[TickRecord] = []
        self._newest: Tick | None = None
        self._due_s = -inf
        self._percept: Percept | None | UnsetType = UNSET

    def update(self, tick: Tick) -> None:
        """Add a tick of a run that is not recorded."""
        self.append(tick, 0.0)

    def append(self, tick: Tick, dt_s: float, before: tuple[BodyRecord, ...] = ()) -> None:
        """Add a tick with its further inputs, and send a batch when it is due."""
        percept = UNSET if tick.percept is self._percept else tick.percept
        self._percept, self._newest = tick.percept, tick
        plain = replace(tick, detections=None, percept=None)
        self._records.append(TickRecord(plain, dt_s, percept, before))
        if not 0.0 <= self._due_s - tick.t_s <= self._every_s:
            self.flush()
            self._due_s = tick.t_s + self._every_s

    def flush(self) -> None:
        """Send the ticks since the last batch."""
        records, newest = self._records, self._newest
        if newest is None or not records:
            return
        self._records = []
        if self.sinks and False in self.sinks.update(
            TickBatch(encode(records), len(records), newest)
        ):
            self._percept = UNSET  # a sink may have lost the present percept


def encode(value: object) -> bytes:
    """Return a value as MessagePack.

    Raises:
        TypeError: A part of it has a type that msgspec does not support.
        UnicodeEncodeError: A text, such as a file name, cannot be written as UTF-8.
    """
    return _encoder.encode(value)


def decode(data: bytes, kind: type[T]) -> T:
    """Return the value of a type that ``encode`` wrote.

    Raises:
        msgspec.MsgspecError: The data is not such a value.
    """
    return msgspec.msgpack.decode(data, type=kind, dec_hook=to_array)


def all_finite(data: bytes) -> bool:
    """Return True if all numbers in MessagePack are finite, False if one may not be."""
    return _NOT_FINITE.search(data) is None


def to_plain(value: Any) -> Any:
    """Return a NumPy array or number as a list or a Python number, for msgspec's encoders."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not part of a tick")


def to_array(kind: Any, value: Any) -> Any:
    """Return a list as a NumPy array, for msgspec's decoders."""
    return np.array(value, float)


_NOT_FINITE = re.compile(rb"\xcb[\x7f\xff][\xf0-\xff]")
"""A double whose exponent has all bits set: nan, inf or, by chance, other equal bytes."""
_encoder = msgspec.msgpack.Encoder(enc_hook=to_plain)

"""Frames from one process to another through shared memory: a few slots, written in rotation.

The reader copies a slot and reads its stamp before and after; a slot that was written meanwhile is
discarded. Neither side waits.
"""

import threading
from contextlib import suppress
from dataclasses import fields
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import Depth, Detections, ImageArray

_SLOTS = 6
_STAMP_BYTES = 64  # a cache line


class SlotAddress(NamedTuple):
    """Address of an array in shared memory.

    memory: its name; slot, slot_bytes: index and size of the slot; stamp: stamp of this write;
        shape, dtype: shape and type of the array
    """

    memory: str
    slot: int
    slot_bytes: int
    stamp: int
    shape: tuple[int, ...]
    dtype: str


class SlotWriter:
    """Writer of arrays into slots; memory grows with them."""

    def __init__(self) -> None:
        self._memory: SharedMemory | None = None
        self._slot_bytes = 0
        self._stamp = 0

    def put(self, array: NDArray[Any]) -> SlotAddress:
        """Copy an array into the next slot."""
        if self._memory is None or array.nbytes > self._slot_bytes:
            self.close()
            self._slot_bytes = -(-array.nbytes // _STAMP_BYTES) * _STAMP_BYTES
            size = _SLOTS * (self._slot_bytes + _STAMP_BYTES)
            self._memory = SharedMemory(create=True, size=size)
        memory = self._memory
        self._stamp += 2  # odd during a write
        slot = self._stamp // 2 % _SLOTS
        stamp, data = _stamp_and_bytes(memory, slot, self._slot_bytes)
        stamp[0] = self._stamp - 1
        np.copyto(data[: array.nbytes].view(array.dtype).reshape(array.shape), array)
        stamp[0] = self._stamp
        return SlotAddress(
            memory.name, slot, self._slot_bytes, self._stamp, array.shape, array.dtype.str
        )

    def close(self) -> None:
        """Free the memory; safe to call twice."""
        if self._memory is not None:
            self._memory.close()
            self._memory.unlink()
        self._memory = None


class SlotReader:
    """Reader of arrays from slots of shared memory, for any thread."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._memory: SharedMemory | None = None
        self._name = ""

    def record_memory(self, where: SlotAddress | None) -> None:
        """Record the writer's memory, even if it is never read."""
        if where is not None:
            self._name = where.memory

    def take(self, where: SlotAddress) -> NDArray[Any] | None:
        """Return a read-only copy of an array; None if its slot was written again meanwhile."""
        with self._lock:
            if self._memory is None or self._memory.name != where.memory:
                self.close()
                try:
                    self._memory = SharedMemory(where.memory)
                except FileNotFoundError:  # the writer now uses larger memory
                    return None
            stamp, data = _stamp_and_bytes(self._memory, where.slot, where.slot_bytes)
            dtype = np.dtype(where.dtype)
            count = int(np.prod(where.shape)) * dtype.itemsize
            array = data[:count].view(dtype).reshape(where.shape).copy()
            if int(stamp[0]) != where.stamp:
                return None
            array.setflags(write=False)
            return array

    def close(self) -> None:
        """Release the memory; safe to call twice."""
        with self._lock:
            if self._memory is not None:
                self._memory.close()
            self._memory = None

    def forget(self) -> None:
        """Free the memory of a writer that has died without doing so."""
        with self._lock:
            self.close()
            name, self._name = self._name, ""
        if name:
            with suppress(FileNotFoundError):  # the writer has freed it already
                memory = SharedMemory(name)
                memory.close()
                memory.unlink()


def _stamp_and_bytes(
    memory: SharedMemory, slot: int, slot_bytes: int
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the stamp and the bytes of a slot."""
    start = slot * (slot_bytes + _STAMP_BYTES)
    buffer = memory.buf
    assert buffer is not None  # it is open
    stamp = np.frombuffer(buffer, np.int64, 1, start)
    data = np.frombuffer(buffer, np.uint8, slot_bytes, start + _STAMP_BYTES)
    return stamp, data


_OTHERS = tuple(one.name for one in fields(Detections) if one.name not in ("image", "depth_m"))
_UNREAD: Any = object()


class SharedDetections(Detections):
    """Detections with image and depth in shared memory.

    The loop's process never reads most frames: the page shows ten per second, a recording contains
    two, and copying all of them takes longer than a tick.

    Both are None if they are first read after their slots were overwritten, some frames later; once
    read, they stay.

    Args:
        found: Detections without image and depth.
        image_at: Address of the image; None for none.
        depth_at: Address of the depth; None for none.
        readers: Readers of images and of depths; for any thread.
    """

    __slots__ = ("_addresses", "_depth", "_image", "_readers")
    _addresses: tuple[SlotAddress | None, SlotAddress | None]
    _depth: Any
    _image: Any
    _readers: tuple[SlotReader, SlotReader]

    def __init__(
        self,
        found: Detections,
        image_at: SlotAddress | None,
        depth_at: SlotAddress | None,
        readers: tuple[SlotReader, SlotReader],
    ) -> None:
        put = object.__setattr__  # as a frozen dataclass itself does
        for name in _OTHERS:
            put(self, name, getattr(found, name))
        put(self, "_addresses", (image_at, depth_at))
        put(self, "_readers", readers)
        put(self, "_image", None if image_at is None else _UNREAD)
        put(self, "_depth", None if depth_at is None else _UNREAD)

    @property
    def image(self) -> ImageArray | None:
        """Return the image if it is still available."""
        if self._image is _UNREAD:
            object.__setattr__(self, "_image", self._read(0))
        image: ImageArray | None = self._image
        return image

    @property
    def depth_m(self) -> Depth | None:
        """Return the depth if it is still available."""
        if self._depth is _UNREAD:
            object.__setattr__(self, "_depth", self._read(1))
        depth: Depth | None = self._depth
        return depth

    def _read(self, which: int) -> NDArray[Any] | None:
        address = self._addresses[which]
        return self._readers[which].take(address) if address is not None else None

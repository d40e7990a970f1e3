"""Frames from one process to another through shared memory: a few slots, written in rotation.

The reader copies a slot and reads its stamp before and after; a slot that was written meanwhile is
discarded. Neither side waits.
"""

from contextlib import suppress
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
            with suppress(FileNotFoundError):  # its reader has freed it
                self._memory.unlink()
        self._memory = None


class SlotReader:
    """Reader of arrays from slots of shared memory."""

    def __init__(self) -> None:
        self._memory: SharedMemory | None = None

    def take(self, where: SlotAddress) -> NDArray[Any] | None:
        """Return a read-only copy of an array; None if its slot was written again meanwhile."""
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
        """Release the memory, and free it if its writer has died; safe to call twice."""
        if self._memory is not None:
            self._memory.close()
            with suppress(FileNotFoundError):  # the writer has freed it already
                self._memory.unlink()
        self._memory = None


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

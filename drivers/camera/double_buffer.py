"""Double buffer in shared memory, from one process to another without a lock.

The writer fills the older entry and then increments the count. The reader reads the count before
and after, and reads again if the entry was overwritten meanwhile.
"""

import multiprocessing
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

CONTEXT = multiprocessing.get_context("spawn")
"""Creates shared memory that can be passed to a new process."""


class DoubleBuffer:
    """Index of the newer of two entries; the user of this class owns their contents."""

    def __init__(self) -> None:
        self._count = CONTEXT.RawValue("q", 0)

    @property
    def count(self) -> int:
        """Return the number of entries written since the start."""
        return int(self._count.value)

    @property
    def older(self) -> int:
        """Return the index of the entry to fill next, 0 or 1."""
        return self.count % 2

    def filled(self) -> None:
        """Mark the older entry as the newer; only one thread writes."""
        self._count.value += 1

    def read(self, copy: Callable[[int], T], above: int = 0) -> tuple[int, T] | None:
        """Return the number of the newest entry and its copy, None without one.

        Args:
            copy: Returns a copy of entry 0 or 1.
            above: Numbers up to this are known already.
        """
        while (count := self.count) > above:
            copied = copy((count - 1) % 2)
            if self.count == count:
                return count, copied
        return None

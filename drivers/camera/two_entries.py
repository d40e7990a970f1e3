"""The newer of two entries in shared memory, from one process to another without a lock.

The writer fills the older entry and then counts it; the reader looks at the count before and
after, and reads again what was overwritten meanwhile.
"""

import multiprocessing
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

CONTEXT = multiprocessing.get_context("spawn")
"""Makes shared memory that can be handed to a process that is being started."""


class TwoEntries:
    """Which of two entries is the newer; what is in them belongs to who uses this."""

    def __init__(self) -> None:
        self._count = CONTEXT.RawValue("q", 0)

    @property
    def count(self) -> int:
        """Return how many entries have been written since the start."""
        return int(self._count.value)

    @property
    def older(self) -> int:
        """Return which entry to fill next, 0 or 1."""
        return self.count % 2

    def filled(self) -> None:
        """Make the older entry the newer; only one thread writes."""
        self._count.value += 1

    def read(self, copy: Callable[[int], T], above: int = 0) -> tuple[int, T] | None:
        """Return the number of the newest entry and its copy, None without one.

        Args:
            copy: returns a copy of entry 0 or 1.
            above: numbers from 1 to this are known already.
        """
        while (count := self.count) > above:
            copied = copy((count - 1) % 2)
            if self.count == count:
                return count, copied
        return None

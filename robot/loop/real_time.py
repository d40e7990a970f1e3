"""Garbage collection, switch interval and time slice of control loops in real time."""

import gc
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from gazerig.drivers.process.priority import SHORT_S, request_slice

_SHORT_S = 0.0003
"""Another thread releases the interpreter after this time instead of the usual 5 ms, which is a
whole slot of the loop."""


def freeze_objects() -> None:
    """Exclude all present objects from later passes of the garbage collector.

    A full pass over the objects from start-up takes 20 ms, four slots. Call this before torque is
    switched on, as nothing may delay the servos afterwards. Objects that were excluded for an
    earlier robot in this process are collected first.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()


@contextmanager
def frozen_objects() -> Iterator[None]:
    """Exclude the present objects from garbage collection during the block.

    For loops in simulated time: as ``freeze_objects``, without the pass over them at the start.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


class SwitchInterval:
    """A short thread switch interval while at least one loop runs, and a short time slice for it.

    Enter and leave it once for each loop, in the loop's thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running = 0
        self._before_s = 0.0

    def __enter__(self) -> None:
        request_slice(SHORT_S)
        with self._lock:
            if not self._running:
                self._before_s = sys.getswitchinterval()
                sys.setswitchinterval(_SHORT_S)
            self._running += 1

    def __exit__(self, *raised: object) -> None:
        request_slice(0.0)
        with self._lock:
            self._running -= 1
            if not self._running:
                sys.setswitchinterval(self._before_s)


SWITCH_INTERVAL = SwitchInterval()

"""Functions called one after another in a thread, so that a slow one delays no caller."""

import threading
from collections.abc import Callable
from queue import SimpleQueue


class WorkQueue:
    """A queue of functions and the daemon thread that calls them in order.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._work: SimpleQueue[Callable[[], object]] = SimpleQueue()
        self._started = False

    def __len__(self) -> int:
        """Return the number of functions that wait for the present one."""
        return self._work.qsize()

    def add(self, work: Callable[[], object]) -> None:
        """Call a function after all earlier ones, without waiting."""
        self._work.put(work)
        if not self._started:
            self._started = True
            threading.Thread(target=self._run, name=self._name, daemon=True).start()

    def wait_idle(self, timeout_s: float) -> bool:
        """Wait until all calls are done, at most ``timeout_s``; return whether they are."""
        if not self._started:
            return True
        idle = threading.Event()
        self.add(idle.set)
        return idle.wait(timeout_s)

    def _run(self) -> None:
        while True:
            self._work.get()()

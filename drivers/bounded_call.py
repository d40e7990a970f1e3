"""Calls that must not hold up the control loop: made in another thread, waited for briefly."""

import threading
from collections.abc import Callable
from time import perf_counter
from typing import Any, NamedTuple


class CallResult(NamedTuple):
    """What came of a call.

    error: what it raised; took_s: how long it ran, without the time until it was begun, which is
    the machine's
    """

    value: Any = None
    error: BaseException | None = None
    took_s: float = 0.0


class BoundedCall:
    """Makes one call after another in a thread of its own.

    A call that is not done in time goes on; its outcome is the next one asked for, and no other
    call is begun before. The thread ends with the program, or after ``close``.

    Args:
        name: of the thread.
        longest_s: a call is waited for so long, real seconds; None: it is made in the caller's
            thread and waited for to its end, for simulated time, in which nothing is late.
    """

    def __init__(self, name: str, longest_s: float | None) -> None:
        self._name, self._longest_s = name, longest_s
        self._thread: threading.Thread | None = None
        self._begin, self._done = threading.Semaphore(0), threading.Semaphore(0)
        self._work: Callable[[], Any] | None = None
        self._outcome = CallResult()
        self._under_way = False
        self._begun_s: float | None = None

    def running_s(self) -> float:
        """Return for how long the present call has been running, 0 where none is."""
        begun_s = self._begun_s
        return 0.0 if begun_s is None else perf_counter() - begun_s

    def __call__(self, work: Callable[[], Any]) -> CallResult | None:
        """Make a call; return its outcome or that of the late one before, None while it lasts."""
        if self._longest_s is None:
            return _outcome(work)
        if not self._under_way:
            if self._thread is None:
                self._thread = threading.Thread(target=self._serve, name=self._name, daemon=True)
                self._thread.start()
            self._work, self._under_way = work, True
            self._begin.release()
            if not self._done.acquire(timeout=self._longest_s):
                return None
        elif not self._done.acquire(blocking=False):
            return None
        self._under_way = False
        return self._outcome

    def close(self) -> None:
        """Let the thread end as soon as it can; a call that lasts is not waited for."""
        if self._thread is not None:
            self._thread, self._work = None, None
            self._begin.release()

    def _serve(self) -> None:
        while True:
            self._begin.acquire()
            work = self._work
            if work is None:
                return
            begun_s = self._begun_s = perf_counter()
            outcome = _outcome(work)
            self._begun_s = None
            self._outcome = outcome._replace(took_s=perf_counter() - begun_s)
            self._done.release()


def _outcome(work: Callable[[], Any]) -> CallResult:
    try:
        return CallResult(work())
    except (Exception, SystemExit) as error:  # a package may do anything
        return CallResult(None, error)

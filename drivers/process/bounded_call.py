"""Calls that must not block the control loop: they run in a thread and are awaited briefly."""

import contextlib
import ctypes
import threading
from collections.abc import Callable
from queue import SimpleQueue
from time import perf_counter
from typing import Any, NamedTuple, Protocol

from gazerig.drivers.plugins import describe_error

_FIRST_END_S, _NEXT_END_S, _LONGEST_END_S = 0.2, 0.05, 2.0
"""An abandoned call is ended after the first time; then again, at an interval that doubles."""

FIRST_LINE_S, _LONGEST_SILENCE_S = 1.0, 60.0
"""A running call is reported after the first time; then again, at an interval that doubles."""


class CallEnded(SystemExit):
    """Exception that ends an abandoned call; raised in its thread, which then ends silently."""


class OverdueSource(Protocol):
    """A source of calls that may block a thread for too long."""

    def overdue_call(self) -> tuple[float, str] | None:
        """Return the run time [s] of the current call and a message; None if none is late."""


OVERDUE_SOURCES: set[OverdueSource] = set()
"""All objects of this program whose calls may block a thread for too long."""


class OverdueReport:
    """Report about ``OVERDUE_SOURCES``, repeated at increasing intervals."""

    def __init__(self) -> None:
        self._due_s: dict[OverdueSource, float] = {}

    def due_lines(self) -> tuple[str, ...]:
        """Return the lines that are due."""
        lasting = _overdue()
        self._due_s = {one: self._due_s.get(one, FIRST_LINE_S) for one, _, _ in lasting}
        due = [found for found in lasting if found[1] >= self._due_s[found[0]]]
        for one, for_s, _ in due:
            self._due_s[one] = for_s + min(for_s, _LONGEST_SILENCE_S)
        return tuple([text for _, _, text in due])


def overdue_text() -> str:
    """Return the calls that last too long as text, "" for none."""
    return "; ".join([text for _, for_s, text in _overdue() if for_s >= FIRST_LINE_S])


def _overdue() -> list[tuple[OverdueSource, float, str]]:
    found = [(one, one.overdue_call()) for one in tuple(OVERDUE_SOURCES)]
    return [(one, *lasts) for one, lasts in found if lasts is not None]


class CallResult(NamedTuple):
    """Result of a call.

    error: exception that it raised, as text in ``error_text``; took_s: run time in seconds, without
        the wait for its start
    """

    value: Any = None
    error: BaseException | None = None
    took_s: float = 0.0
    error_text: str = ""


class _Call:
    """A call; ``done`` is released at its end."""

    def __init__(self, work: Callable[[], Any]) -> None:
        self._work = work
        self.outcome = CallResult()
        self.done = threading.Lock()
        self.done.acquire()

    def make(self) -> None:
        begun_s = perf_counter()
        outcome = _call_result(self._work, BaseException)
        self.outcome = outcome._replace(took_s=perf_counter() - begun_s)
        self.done.release()


class BoundedCall:
    """Calls made one after another in a separate thread, with a time limit.

    A call that exceeds its limit continues; the next request returns its result, and no other call
    begins before. The thread ends with the program, or after ``close``.

    Args:
        name: Name of the called object in messages.
        longest_s: Longest wait for a call, real seconds. None: the call runs in the caller's thread
            to its end, for simulated time, in which nothing is late.
    """

    def __init__(self, name: str, longest_s: float | None) -> None:
        self._name, self._longest_s = name, longest_s
        self._thread: threading.Thread | None = None
        self._calls: SimpleQueue[_Call | None] = SimpleQueue()
        self._late: _Call | None = None
        self._begun_s: float | None = None
        self._starting, self._leaving = threading.Lock(), threading.Lock()
        self._left = False
        self._closed_s: float | None = None

    def running_s(self) -> float:
        """Return the run time of the present call, seconds; 0 without one."""
        begun_s = self._begun_s
        return 0.0 if begun_s is None else perf_counter() - begun_s

    def waiting_calls(self) -> int:
        """Return the number of calls that wait for the present one."""
        return self._calls.qsize()

    def __call__(self, work: Callable[[], Any]) -> CallResult | None:
        """Make a call; return its result or that of the late one before, None while that lasts."""
        if self._longest_s is None:
            return _call_result(work, (Exception, SystemExit))
        if self._late is not None:
            return self._await_result(self._late, 0.0)
        return self._await_result(self._submit(work), self._longest_s)

    def begin(self, work: Callable[[], Any]) -> None:
        """Make a call after all earlier ones and ignore its result; never wait."""
        with contextlib.suppress(RuntimeError):  # no memory for a thread: the next call tries again
            self._submit(work)

    def call_in_order(self, work: Callable[[], Any], longest_s: float) -> CallResult | None:
        """Make a call after the previous late one, whose result is discarded; None if one runs.

        longest_s: longest wait for each, seconds
        """
        if self._longest_s is None:
            return self(work)
        if self._late is not None and self._await_result(self._late, longest_s) is None:
            return None
        return self._await_result(self._submit(work), longest_s)

    def wait_idle(self, longest_s: float) -> bool:
        """Wait until all calls are done, at most ``longest_s`` [s]; return whether they are."""
        return (
            self._late is None
            or self._await_result(self._submit(_do_nothing), longest_s) is not None
        )

    def _submit(self, work: Callable[[], Any]) -> _Call:
        call = _Call(work)
        self._calls.put(call)
        self._late = call
        with self._starting:
            if self._thread is None:
                thread = threading.Thread(target=self._serve, name=self._name, daemon=True)
                thread.start()
                self._thread = thread
        return call

    def _await_result(self, call: _Call, patience_s: float) -> CallResult | None:
        if not call.done.acquire(timeout=patience_s):
            return None
        self._late = None
        return call.outcome

    def close(self) -> None:
        """End the thread; a running call is ended without waiting, and no other begins.

        Running Python code ends with a ``CallEnded``, raised again if it is caught. A wait outside
        Python cannot be ended: it is in ``OVERDUE_SOURCES`` while it is running.
        """
        thread, self._thread = self._thread, None
        if thread is None:
            return
        self._closed_s = perf_counter()
        self._calls.put(None)
        if self._late is None:
            thread.join(_NEXT_END_S)  # it has nothing left to do
        else:
            OVERDUE_SOURCES.add(self)
            ending = threading.Thread(
                target=self._end, args=(thread,), name=f"end of {self._name}", daemon=True
            )
            ending.start()

    def overdue_call(self) -> tuple[float, str]:
        """Return the time [s] for which an abandoned call has been running, and a message."""
        for_s = perf_counter() - (self._closed_s or 0.0)
        return for_s, (
            f"{self._name} was abandoned {for_s:.0f} s ago and has not ended: it may slow the loop "
            "while this program runs"
        )

    def _end(self, thread: threading.Thread) -> None:
        """End the thread, with as many attempts as needed."""
        thread.join(_FIRST_END_S)
        wait_s = _NEXT_END_S
        while thread.is_alive():
            # Never after the thread has ended: another one may have its number.
            with self._leaving:
                if not self._left and thread.ident is not None:
                    # Raised in the thread once it runs Python code again.
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(
                        ctypes.c_ulong(thread.ident), ctypes.py_object(CallEnded)
                    )
            thread.join(wait_s)
            wait_s = min(2.0 * wait_s, _LONGEST_END_S)
        OVERDUE_SOURCES.discard(self)

    def _serve(self) -> None:
        try:
            while (call := self._calls.get()) is not None and self._closed_s is None:
                self._begun_s = perf_counter()
                call.make()
                self._begun_s = None
        finally:
            with self._leaving:
                self._left = True


def _do_nothing() -> None:
    """Do nothing; used to wait for all earlier calls."""


def _call_result(
    work: Callable[[], Any], caught: type[BaseException] | tuple[type[BaseException], ...]
) -> CallResult:
    try:
        return CallResult(work())
    except caught as error:  # a package may raise anything
        try:
            return CallResult(None, error, error_text=describe_error(error))
        except Exception:  # even str() of its error may fail
            return CallResult(None, error, error_text=type(error).__name__)

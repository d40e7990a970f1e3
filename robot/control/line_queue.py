"""Queue of message lines, delivered by a thread: a slow receiver delays no caller."""

import contextlib
import sys
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Self

from gazerig.drivers.plugins import describe_error
from gazerig.drivers.process.bounded_call import OVERDUE_SOURCES, BoundedCall

_MOST = 500
"""Number of waiting lines; further ones are dropped."""
_END_S = 1.0
"""Time to deliver the last lines."""


class LineQueue:
    """A queue of lines for a function that may block or fail, in the order of the calls.

    While its block lasts, a function that does not return is in ``OVERDUE_SOURCES``. The end of the
    block waits for at most a second and reports undelivered lines on standard error.

    Args:
        deliver: Called with one line after another, in one thread.
        name: Name of the receiver in messages.
        most: Number of waiting lines; further ones are dropped.

    Attributes:
        dropped: Number of lines that were not delivered.
    """

    def __init__(self, deliver: Callable[[str], object], name: str, most: int = _MOST) -> None:
        self._deliver, self._name, self._most = deliver, name, most
        self._call = BoundedCall(name, 0.0)
        self._missing = 0
        self._failure = ""
        self.dropped = 0

    def line(self, text: str) -> None:
        """Queue a line without waiting."""
        if self._call.waiting_calls() >= self._most:
            self.dropped += 1
            self._missing += 1
        else:
            self._call.begin(partial(self._deliver_line, text))

    def flush(self, timeout_s: float) -> bool:
        """Wait until everything is delivered or the time is over; return whether it is."""
        return self._call.wait_idle(timeout_s)

    def overdue_call(self) -> tuple[float, str] | None:
        """Return the duration [s] of a blocked delivery and a text, None if none is blocked."""
        for_s = self._call.running_s()
        if for_s == 0.0:
            return None
        waiting = f"{self._call.waiting_calls()} lines are waiting, {self.dropped} are lost"
        return for_s, f"{self._name} has not returned for {for_s:.0f} s: {waiting}"

    def __enter__(self) -> Self:
        """Start watching the receiver."""
        OVERDUE_SOURCES.add(self)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Wait for the running delivery, and abandon it after a second."""
        blocked = not self.flush(_END_S)
        OVERDUE_SOURCES.discard(self)
        lost = self.dropped + self._call.waiting_calls() * blocked
        self._call.close()
        if lost:
            why = f"{self._name} does not return" if blocked else self._failure or "it was slow"
            last = LineQueue(_to_stderr, "standard error")
            last.line(f"gazerig: {lost} lines were not delivered: {why}\n")
            last.flush(_END_S)

    def _deliver_line(self, text: str) -> None:
        """Deliver a line, preceded by a note about lost ones."""
        missing, self._missing = self._missing, 0
        try:
            if missing:
                self._deliver(f"{missing} lines are missing here: {self._name} was too slow")
            self._deliver(text)
        except BaseException as error:
            self.dropped += 1
            self._failure = f"{self._name} failed ({describe_error(error)})"


def _to_stderr(line: str) -> None:
    with contextlib.suppress(OSError, ValueError, AttributeError):
        sys.stderr.write(line)

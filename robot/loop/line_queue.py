"""Queue of message lines, delivered by a thread: a slow receiver delays no caller."""

import contextlib
import sys
from collections.abc import Callable
from functools import partial
from typing import Self

from gazerig.drivers.plugins import describe_error
from gazerig.drivers.process.work_queue import WorkQueue

_MOST = 500
"""Number of waiting lines; further ones are dropped."""
_END_S = 1.0
"""Time to deliver the last lines."""


class LineQueue:
    """A queue of lines for a function that may block or fail, in the order of the calls.

    The end of the block waits for at most a second. A failure is named on standard error.

    Args:
        deliver: Called with one line after another, in one thread.
        name: Name of the receiver in messages.
    """

    def __init__(self, deliver: Callable[[str], object], name: str) -> None:
        self._deliver, self._name = deliver, name
        self._lines = WorkQueue(name)

    def line(self, text: str) -> None:
        """Queue a line without waiting."""
        if len(self._lines) < _MOST:
            self._lines.add(partial(self._deliver_line, text))

    def __enter__(self) -> Self:
        """Return the queue."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Wait for the last lines, and abandon them after a second."""
        self._lines.wait_idle(_END_S)

    def _deliver_line(self, text: str) -> None:
        try:
            self._deliver(text)
        except BaseException as error:
            with contextlib.suppress(OSError, ValueError, AttributeError):
                sys.stderr.write(
                    f"gazerig: {self._name} failed ({describe_error(error)}) at: {text}\n"
                )

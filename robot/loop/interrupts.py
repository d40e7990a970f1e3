"""Handling of signals that end this program: they are recorded, so that the head parks first."""

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, Self

from gazerig.robot.model.clock import RealClock

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Ctrl-C, a request to end, a terminal that was closed, and Ctrl-backslash."""
_HANG_UP = (signal.SIGHUP,)
_BACKGROUND = (signal.SIGTTIN, signal.SIGTTOU)
"""Signals that would stop a background program when it accesses its terminal, with the torque on.
"""

_NEVER = 1 << 30
"""A number above that of possible requests."""

SAME_REQUEST_S = 0.3
"""Signals closer together count as one request: shell and kernel each send their own."""


class Interrupts:
    """A recorder of requests to end this program, active inside its block.

    The first request is only recorded: the work reads it by calling this object. A second one
    raises KeyboardInterrupt, because the work may hang, unless ``is_spared`` forbids it. SIGHUP is
    never a second one: one closed terminal sends it several times.

    Args:
        now_s: Returns the time; default: the host's.
        also: Returns another reason to end, None while there is none.
        signals: Record signals; if False, only ``request`` counts and handlers stay unchanged.
    """

    def __init__(
        self,
        now_s: Callable[[], float] | None = None,
        also: Callable[[], str | None] | None = None,
        signals: bool = True,
    ) -> None:
        self._also, self._signals = also, signals
        self._now_s = now_s if now_s is not None else RealClock().now_s
        self._first: str | None = None
        self._last_s = 0.0
        self._more = 0
        self._before: dict[signal.Signals, Any] = {}
        self._depth = 0
        self.tolerated_requests = 1
        """Number of requests that are recorded before one raises KeyboardInterrupt."""
        self.is_spared: Callable[[FrameType | None], bool] = lambda frame: False
        """Returns whether the function of a frame must never be interrupted."""

    @classmethod
    def from_stop(cls, stopped: Callable[[], str | None]) -> "Interrupts":
        """Return ``stopped`` if it is an Interrupts, otherwise a new one that calls it."""
        return stopped if isinstance(stopped, Interrupts) else cls(also=stopped)

    def __enter__(self) -> Self:
        """Start recording; signals are recorded only in the main thread.

        A nested block changes nothing.
        """
        self._depth += 1
        main = threading.current_thread() is threading.main_thread()
        if main and self._signals and self._depth == 1:
            for number in ENDING:
                # A program started with nohup must outlive the terminal.
                if number in _HANG_UP and signal.getsignal(number) == signal.SIG_IGN:
                    continue
                self._before[number] = signal.signal(number, self._record)
            for number in _BACKGROUND:
                self._before[number] = signal.signal(number, signal.SIG_IGN)
        return self

    def __exit__(self, *raised: object) -> None:
        """Restore the previous signal handlers."""
        self._depth -= 1
        if self._depth:
            return
        before, self._before = self._before, {}
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)

    def __call__(self) -> str | None:
        """Return the name of the first signal or the other reason to end, None before any."""
        if self._first is None and self._also is not None:
            other = self._also()
            # A signal or another thread may have made a request meanwhile; it has priority.
            if other is not None and self._first is None:
                self._first = other
        return self._first

    def request(self, reason: str) -> None:
        """Request the end from any thread; a second request skips the rest of parking."""
        if self._first is None:
            self._first = reason
        else:
            self._more += 1

    @property
    def requests(self) -> int:
        """Return the number of requests to end."""
        return self._more + (self._first is not None)

    def only_record(self) -> None:
        """Only record further requests: the work checks for them often enough."""
        self.tolerated_requests = _NEVER

    def raise_if_requested(self) -> None:
        """Raise if the end was requested before anything has to be parked.

        Raises:
            KeyboardInterrupt: The end was requested.
        """
        if self() is not None:
            raise KeyboardInterrupt

    def _record(self, number: int, frame: FrameType | None) -> None:
        now_s, last_s = self._now_s(), self._last_s
        self._last_s = now_s
        if self._first is None:
            self._first = signal.Signals(number).name
        elif number in _HANG_UP or now_s - last_s < SAME_REQUEST_S:
            return
        else:
            self._more += 1
        if self.requests > self.tolerated_requests and not self.is_spared(frame):
            raise KeyboardInterrupt

"""Shutdown of everything that switches torque on: park, torque off, one line.

    with PowerDown(park, control.stop, report, interrupts) as power:
        power.switch_on(control.start)
        ...

At any end of the block (a signal, an exception, lack of memory or the end of the work), the head
parks in bounded time and the torque is switched off. Nothing is written to a terminal before that,
and writing cannot prevent it.
"""

import contextlib
import signal
import threading
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any, Self, TypeVar

from gazerig.drivers.errors import DriverError
from gazerig.robot.loop.events import group_events
from gazerig.robot.model.clock import RealClock

T = TypeVar("T")

Again = Callable[[], bool]
"""Returns whether the end was requested again, which skips the rest of parking."""

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


class PowerDown:
    """A block that switches the torque off at its end.

    Args:
        park: Moves to the parking pose in bounded time; returns a text such as "parked". None
            to switch the torque off at the present angles.
        torque_off: Switches the torque of all servos off and closes the bus; returns the bus's
            messages about servos that do not confirm it.
        report: Receives one line about the result.
        interrupts: Requests to end this program.
        off: Text for torque that is off.
        left: Text for unreachable servos, after the reason.
        quiet: Whether to report nothing if the torque was switched off properly.

    Attributes:
        cause: Reason for the end in the line, "" for none.
        unreleased: Messages about servos whose torque may still be on.
    """

    def __init__(
        self,
        park: Callable[[Again], str] | None,
        torque_off: Callable[[], Sequence[str] | None],
        report: Callable[[str], None],
        interrupts: Interrupts,
        off: str = "torque off",
        left: str = "",
        quiet: bool = False,
    ) -> None:
        self._park, self._torque_off, self._report = park, torque_off, report
        self._interrupts = interrupts
        self._off, self._left, self._quiet = off, left, quiet
        self._starting = self._on = False
        self.cause = ""
        self.unreleased: tuple[str, ...] = ()

    def switch_on(self, start: Callable[[], T]) -> T:
        """Call ``start``, which switches the torque on, and return its result.

        Args:
            start: If it raises a DriverError, it has switched everything off again.
        """
        self._starting = True
        try:
            result = start()
        except DriverError:
            self._starting = False
            raise
        self._on = True
        return result

    def __enter__(self) -> Self:
        """Start the block."""
        # An interrupt may occur only in the functions that this file calls.
        self._interrupts.is_spared = lambda frame: (
            frame is not None and frame.f_code.co_filename == __file__
        )
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """End the block with the torque off."""
        if isinstance(error, KeyboardInterrupt):
            self.cause = self.cause or self._interrupts() or "an interrupt"
        elif isinstance(error, Exception) and not isinstance(error, DriverError):
            self.cause = self.cause or f"fault: unexpected {_error_text(error)}"
        if self._on:
            self.shut_down()
        elif self._starting:  # an interrupted start may have left torque on
            self._interrupts.only_record()
            with contextlib.suppress(BaseException):
                self._torque_off()
            self._interrupts.tolerated_requests = max(1, self._interrupts.requests)

    def shut_down(self) -> None:
        """Park, switch the torque off, close, and report the result; never raise."""
        interrupts = self._interrupts
        asked = interrupts.requests
        # The next request skips the rest of parking; a further one interrupts parking that hangs.
        interrupts.tolerated_requests = asked + 1
        how = ""
        try:
            if self._park is not None:
                how = f"{self._park(lambda: interrupts.requests > asked)}, "
        except BaseException as error:
            how = f"not parked ({_error_text(error)}), "
        interrupts.only_record()
        failed = True
        try:
            self.unreleased = tuple(group_events(self._torque_off() or ()))
            how, failed = how + "; ".join((self._off, *self.unreleased)), bool(self.unreleased)
        except BaseException as error:
            how += f"torque-off could not be sent ({_error_text(error)}){self._left}"
            self.unreleased = (_error_text(error),)
        self._on = self._starting = False
        with contextlib.suppress(Exception):
            if failed or not self._quiet:
                self._report(f"stopped by {self.cause}: {how}" if self.cause else how)
        interrupts.tolerated_requests = max(1, interrupts.requests)


def _error_text(error: BaseException) -> str:
    """Return an exception in one line; for expected ones only the message."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted"
    what = " ".join(str(error).split())
    if isinstance(error, DriverError) and what:
        return what
    return f"{type(error).__name__}: {what}" if what else type(error).__name__

"""Shutdown of everything that switches torque on: park, torque off, one line.

    with PowerDown(park, control.stop, report, interrupts) as power:
        power.switch_on(control.start)
        ...

At any end of the block (a signal, an exception, lack of memory or the end of the work), the head
parks in bounded time and the torque is switched off. Nothing is written to a terminal before that,
and writing cannot prevent it.
"""

import contextlib
from collections.abc import Callable, Sequence
from typing import Self, TypeVar

from gazerig.drivers.errors import DriverError
from gazerig.robot.loop.event_text import group_events
from gazerig.robot.loop.interrupts import Interrupts

T = TypeVar("T")

Again = Callable[[], bool]
"""Returns whether the end was requested again, which skips the rest of parking."""


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
        result: Text of the result, "" before the end.
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
        self.result = ""
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
        self.result = how
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

"""The one way out of everything that switches torque on: park, torque off, one line.

    with PowerDown(park, control.stop, say, interrupts) as way_out:
        way_out.switch_on(control.start)
        ...

Whatever ends the block, a signal, an exception, the end of the memory or the work itself, the
head parks in bounded time and the torque goes off. Nothing is written to a terminal before
that, and what is written cannot keep it from happening.
"""

import contextlib
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Self, TypeVar

from gazerig.drivers.errors import DriverError
from gazerig.robot.control.event_text import drawn_together
from gazerig.robot.control.interrupts import Interrupts

T = TypeVar("T")

Again = Callable[[], bool]
"""Returns whether the end was requested again: the rest of parking is skipped then."""


class PowerDown:
    """Switches on what it also switches off.

    Args:
        park: moves to the parking pose in bounded time; returns what to say of it, such as
            "parked". None: torque goes off where the joints are.
        torque_off: switches torque off on all servos and closes the bus; returns what the bus
            says of servos that do not confirm it.
        say: gets the line that tells how it went.
        interrupts: requests to end this program.
        off: what to say of torque that is off.
        left: what to say of servos that could not be reached, after the reason.
        quiet: says nothing where the torque went off as it should.

    cause: why it ended, for the line; "" says nothing of it
    how: what became of it, "" before the end
    unreleased: what is said of servos whose torque may still be on
    """

    def __init__(
        self,
        park: Callable[[Again], str] | None,
        torque_off: Callable[[], Sequence[str] | None],
        say: Callable[[str], None],
        interrupts: Interrupts,
        off: str = "torque off",
        left: str = "",
        quiet: bool = False,
    ) -> None:
        self._park, self._torque_off, self._say = park, torque_off, say
        self._interrupts = interrupts
        self._off, self._left, self._quiet = off, left, quiet
        self._starting = self._on = False
        self.cause = ""
        self.how = ""
        self.unreleased: tuple[str, ...] = ()

    def switch_on(self, start: Callable[[], T]) -> T:
        """Call what switches torque on; return what it returns.

        start: where it raises a DriverError, it has switched everything off again
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
        """Guard the block."""
        self._interrupts.spared = _at_work_here
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Leave with the torque off."""
        if isinstance(error, KeyboardInterrupt):
            self.cause = self.cause or self._interrupts() or "an interrupt"
        elif isinstance(error, Exception) and not isinstance(error, DriverError):
            self.cause = self.cause or f"fault: unexpected {_words(error)}"
        if self._on:
            self.leave()
        elif self._starting:  # what broke off the start may have left something on
            self._interrupts.never_raise()
            with contextlib.suppress(BaseException):
                self._torque_off()
            self._interrupts.tolerated = max(1, self._interrupts.requests)

    def leave(self) -> None:
        """Park, torque off, close, and say what of it worked; never raises."""
        interrupts = self._interrupts
        asked = interrupts.requests
        # The next request skips the rest of parking, one more breaks it off should it hang.
        interrupts.tolerated = asked + 1
        how = ""
        try:
            if self._park is not None:
                how = f"{self._park(lambda: interrupts.requests > asked)}, "
        except BaseException as error:
            how = f"not parked ({_words(error)}), "
        interrupts.never_raise()
        failed = True
        try:
            self.unreleased = tuple(drawn_together(self._torque_off() or ()))
            how, failed = how + "; ".join((self._off, *self.unreleased)), bool(self.unreleased)
        except BaseException as error:
            how += f"torque-off could not be sent ({_words(error)}){self._left}"
            self.unreleased = (_words(error),)
        self._on = self._starting = False
        self.how = how
        with contextlib.suppress(Exception):
            if failed or not self._quiet:
                self._say(f"stopped by {self.cause}: {how}" if self.cause else how)
        interrupts.tolerated = max(1, interrupts.requests)


def _at_work_here(frame: FrameType | None) -> bool:
    """Return whether this very file is at work: it can be interrupted only in what it calls."""
    return frame is not None and frame.f_code.co_filename == __file__


def _words(error: BaseException) -> str:
    """Return an exception in one line; of those that are no wonder, the message alone."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted"
    what = " ".join(str(error).split())
    if isinstance(error, DriverError) and what:
        return what
    return f"{type(error).__name__}: {what}" if what else type(error).__name__

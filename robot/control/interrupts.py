"""Signals that ask this program to end: noted, so that the head parks before it does."""

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, Self

from gazerig.robot.model.clock import RealClock


def signals_of(*names: str) -> tuple[signal.Signals, ...]:
    """Return the signals of these names that this system has."""
    return tuple(one for name in names if (one := getattr(signal, name, None)) is not None)


ENDING = signals_of("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")
"""Ctrl-C, a request to end, a terminal that was closed, Ctrl-backslash, and Windows' Ctrl-Break."""
_HANG_UP = signals_of("SIGHUP")
_BACKGROUND = signals_of("SIGTTIN", "SIGTTOU")
"""Would stop a program in the background for a look at its terminal, with the torque on."""

_NEVER = 1 << 30
"""So many requests to end never come."""

SAME_REQUEST_S = 0.3
"""Signals closer together are one request: a shell and the kernel each send their own."""


class Interrupts:
    """Requests to end this program, noted while the block lasts.

    Args:
        now_s: gives the time; the host's where nothing is said.
        also: gives another reason to end, None while there is none.
        signals: note signals; else only ``request`` counts, and handlers stay as they are.

    The first is only recorded: the work asks for it by calling this object. A second one
    raises KeyboardInterrupt, because the work may hang, except where ``held_off`` says
    otherwise. SIGHUP is never a second one: it comes several times from one closed terminal.
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
        self.tolerated = 1
        """So many requests are noted before one raises KeyboardInterrupt."""
        self.spared: Callable[[FrameType | None], bool] = lambda frame: False
        """Tells whether the function at work must not be interrupted whatever comes."""

    @classmethod
    def of(cls, stopped: Callable[[], str | None]) -> "Interrupts":
        """Return the interrupts behind a function that gives why to stop, new ones elsewhere."""
        return stopped if isinstance(stopped, Interrupts) else cls()

    def __enter__(self) -> Self:
        """Begin to note; in another thread than the main one nothing can be noted.

        A block inside a block changes nothing.
        """
        self._depth += 1
        main = threading.current_thread() is threading.main_thread()
        if main and self._signals and self._depth == 1:
            for number in ENDING:
                # Who starts a program with nohup wants it to outlive the terminal.
                if number in _HANG_UP and signal.getsignal(number) == signal.SIG_IGN:
                    continue
                self._before[number] = signal.signal(number, self._note)
            for number in _BACKGROUND:
                self._before[number] = signal.signal(number, signal.SIG_IGN)
        return self

    def __exit__(self, *raised: object) -> None:
        """Restore the signal handlers of before."""
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
            # Meanwhile a signal or another thread may have asked: that is not to be forgotten.
            if other is not None and self._first is None:
                self._first = other
        return self._first

    def request(self, reason: str) -> None:
        """Ask for the end from any thread; asked again, it skips what is left of parking."""
        if self._first is None:
            self._first = reason
        else:
            self._more += 1

    @property
    def requests(self) -> int:
        """Return how often this program was asked to end."""
        return self._more + (self._first is not None)

    def never_raise(self) -> None:
        """Only record from now on: the work asks often enough."""
        self.tolerated = _NEVER

    def refuse(self) -> None:
        """End here what was asked to end before there was anything to park.

        Raises:
            KeyboardInterrupt: it was.
        """
        if self() is not None:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        now_s, last_s = self._now_s(), self._last_s
        self._last_s = now_s
        if self._first is None:
            self._first = signal.Signals(number).name
        elif number in _HANG_UP or now_s - last_s < SAME_REQUEST_S:
            return
        else:
            self._more += 1
        if self.requests > self.tolerated and not self.spared(frame):
            raise KeyboardInterrupt

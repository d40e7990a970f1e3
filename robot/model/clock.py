"""The loop's rate, and clocks: a real one, which waits, and a simulated one, whose time is set."""

import time
from dataclasses import dataclass
from typing import Annotated, Protocol

from gazerig.params import Bounds


@dataclass(frozen=True)
class LoopParams:
    """The control rate."""

    rate_hz: Annotated[float, Bounds(20, 1000), "control rate"] = 200.0


class Clock(Protocol):
    """A monotonic clock in seconds that can wait for an absolute time."""

    def now_s(self) -> float:
        """Return the time."""

    def sleep_until(self, t_s: float) -> None:
        """Wait until ``t_s``; return immediately if it is past."""


class RealClock:
    """The host's monotonic clock."""

    def now_s(self) -> float:
        """Return the host's monotonic time."""
        return time.monotonic()

    def sleep_until(self, t_s: float) -> None:
        """Sleep until ``t_s``."""
        wait = t_s - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)


class SimulatedClock:
    """A clock whose time is set: a simulated minute takes only the time of its computation."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s

    def now_s(self) -> float:
        """Return the simulated time."""
        return self._now_s

    def sleep_until(self, t_s: float) -> None:
        """Set the time, never backwards."""
        if t_s > self._now_s:
            self._now_s = t_s

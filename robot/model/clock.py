"""The only places where time passes: the real clock waits, the simulated one is set."""

import time
from typing import Protocol


class Clock(Protocol):
    """Monotonic seconds, and waiting for an absolute instant."""

    def now_s(self) -> float:
        """Return the time."""
        ...

    def sleep_until(self, t_s: float) -> None:
        """Return no earlier than ``t_s``; at once when it is past."""
        ...


class RealClock:
    """The host's monotonic clock."""

    def now_s(self) -> float:
        """Return the host's monotonic time."""
        return time.monotonic()

    def sleep_until(self, t_s: float) -> None:
        """Wait in the kernel."""
        wait = t_s - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)


class SimulatedClock:
    """A number that is set: a simulated minute takes as long as its arithmetic."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s

    def now_s(self) -> float:
        """Return the number."""
        return self._now_s

    def sleep_until(self, t_s: float) -> None:
        """Set the number, never backwards."""
        if t_s > self._now_s:
            self._now_s = t_s

"""The status line of a running rig: one line of words, five times a second."""

from collections.abc import Callable

from gazerig.drivers.types import BusHealth
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_text import doing, guard_text, health_text

_LINE_S = 0.2
_RATE_S = 1.0


class StatusLine:
    """Rewrites the status line with the newest tick, now and then.

    Args:
        write: rewrites the line, without waiting.
        health: returns the present state of the bus.
    """

    def __init__(self, write: Callable[[str], None], health: Callable[[], BusHealth]) -> None:
        self._write, self._health = write, health
        self._due_s: float | None = None
        self._ticks = 0
        self._hz = 0.0
        self._from: tuple[float, int] | None = None

    def update(self, tick: Tick) -> None:
        """Add a tick; called by the loop."""
        self._ticks += 1
        if self._due_s is None or tick.t_s >= self._due_s:
            self._due_s = tick.t_s + _LINE_S
            self._write(self._line(tick))

    def _line(self, tick: Tick) -> str:
        start_s, ticks = self._from = self._from or (tick.t_s, self._ticks)
        if tick.t_s - start_s >= _RATE_S:
            self._hz = (self._ticks - ticks) / (tick.t_s - start_s)
            self._from = (tick.t_s, self._ticks)
        parts = [
            f"{self._hz:5.1f} Hz",
            doing(tick).headline,
            guard_text(tick.guard_result),
            health_text(self._health()),
        ]
        return " | ".join(parts)

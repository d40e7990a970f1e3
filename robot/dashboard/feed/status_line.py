"""Status line of a running rig, rewritten five times a second."""

from collections.abc import Callable
from math import inf

from gazerig.drivers.process.host_lateness import LATE_COMPUTER
from gazerig.drivers.types import BusHealth
from gazerig.robot.loop.head_state import head_state
from gazerig.robot.loop.tick import Tick
from gazerig.robot.loop.timing import busy_text
from gazerig.robot.model.types import GuardResult, LoopFigures

_LINE_S = 0.2
_RATE_S = 1.0


class StatusLine:
    """Rewrites the status line with the newest tick at a limited rate.

    Args:
        write: rewrites the line, without waiting.
        health: returns the present state of the bus.
        timing: Returns the timing of the loop; None if it is not known yet.
    """

    def __init__(
        self,
        write: Callable[[str], None],
        health: Callable[[], BusHealth],
        timing: Callable[[], LoopFigures | None],
    ) -> None:
        self._write, self._health, self._timing = write, health, timing
        self._due_s: float | None = None
        self._timed_s = -inf
        self._busy = self._rate = ""

    def update(self, tick: Tick) -> None:
        """Add a tick; called by the loop."""
        if self._due_s is None or tick.t_s >= self._due_s:
            self._due_s = tick.t_s + _LINE_S
            if abs(tick.t_s - self._timed_s) >= _RATE_S:
                self._timed_s, timing = tick.t_s, self._timing()
                known = timing is not None and timing.over_s >= 0.9 * _RATE_S
                self._rate = f"{timing.rate_hz:5.1f} Hz" if timing is not None and known else ""
                self._busy = busy_text(timing)
            parts = [
                self._busy,
                self._rate,
                head_state(tick).headline,
                guard_text(tick.guard_result),
                health_text(self._health()),
                *[f"camera: {text.partition(':')[0]}" for text in tick.camera_conditions],
            ]
            self._write(" | ".join(filter(None, parts)))


def guard_text(guard_result: GuardResult) -> str:
    """Return the guard's effect on the desired angles, e.g. "limited (neck_yaw: too fast, +2)"."""
    if not guard_result.reasons:
        return guard_result.level.replace("_", " ")
    more = f", +{len(guard_result.reasons) - 1}" if len(guard_result.reasons) > 1 else ""
    return f"{guard_result.level.replace('_', ' ')} ({guard_result.reasons[0]}{more})"


def health_text(health: BusHealth) -> str:
    """Return the state of the bus, e.g. "bus: timeout 3 times"; lateness is not counted."""
    errors = [
        f"{kind} {n} time{'s' if n > 1 else ''}"
        for kind, n in sorted(health.errors.items())
        if n and kind != LATE_COMPUTER
    ]
    return f"bus: {', '.join(errors)}" if errors else "bus ok"

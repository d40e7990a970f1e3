"""Time of control loops: their figures, and what keeps them punctual in real time."""

import gc
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from gazerig.drivers.process.priority import SHORT_S, request_slice
from gazerig.robot.model.types import LoopFigures

OVER_S = 5.0
"""Time that the figures cover."""
BUSY_SHARE = 0.05
"""A computer that misses this share of the slots is too busy."""
_SHORTEST_S = 3.0
"""Shortest time for a message, s."""


class LoopTiming:
    """The timing figures of the last seconds.

    A late tick counts twice, as a long wait and a short one. Skipped slots count as overruns and
    are subtracted from the wait.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rows: deque[tuple[float, int, float]] = deque()
        self._period_s = 1.0 / rate_hz
        self._last_s: float | None = None

    def update(self, t_s: float) -> None:
        """Record the start time of a tick; a time before the last resets the record."""
        last_s, self._last_s = self._last_s, t_s
        if last_s is None or t_s <= last_s:
            self._rows.clear()
            return
        wait_s = t_s - last_s
        slots = max(1, round(wait_s / self._period_s))
        self._rows.append((t_s, slots - 1, wait_s - self._period_s))
        while t_s - self._rows[0][0] >= OVER_S:
            self._rows.popleft()

    def figures(self) -> LoopFigures | None:
        """Return the figures, None before the second tick. Thread-safe."""
        rows = list(self._rows)
        if not rows:
            return None
        overruns = sum(skipped for _, skipped, _ in rows)
        spread_s = rows[-1][0] - rows[0][0]
        return LoopFigures(
            rate_hz=(len(rows) - 1) / spread_s if spread_s > 0.0 else 1.0 / self._period_s,
            overruns=overruns,
            over_s=min(OVER_S, spread_s),
            late_share=overruns / (overruns + len(rows)),
            latest_ms=1e3 * max(0.0, *[late_s for *_, late_s in rows]),
        )


def busy_text(figures: LoopFigures | None) -> str:
    """Return a text if the computer is too busy, otherwise "".

    Args:
        figures: Figures of the last seconds, None if unknown.
    """
    if figures is None or figures.over_s < _SHORTEST_S or figures.late_share < BUSY_SHARE:
        return ""
    return (
        f"the computer is too busy: {figures.late_share:.0%} of ticks came late "
        f"(worst {figures.latest_ms:.0f} ms)"
    )


_SHORT_S = 0.0003
"""Another thread releases the interpreter after this time instead of the usual 5 ms, which is a
whole slot of the loop."""


def freeze_objects() -> None:
    """Exclude all present objects from later passes of the garbage collector.

    A full pass over the objects from start-up takes 20 ms, four slots. Call this before torque is
    switched on, as nothing may delay the servos afterwards. Objects that were excluded for an
    earlier robot in this process are collected first.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()


@contextmanager
def frozen_objects() -> Iterator[None]:
    """Exclude the present objects from garbage collection during the block.

    For loops in simulated time: as ``freeze_objects``, without the pass over them at the start.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


class SwitchInterval:
    """A short thread switch interval while at least one loop runs, and a short time slice for it.

    Enter and leave it once for each loop, in the loop's thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running = 0
        self._before_s = 0.0

    def __enter__(self) -> None:
        request_slice(SHORT_S)
        with self._lock:
            if not self._running:
                self._before_s = sys.getswitchinterval()
                sys.setswitchinterval(_SHORT_S)
            self._running += 1

    def __exit__(self, *raised: object) -> None:
        request_slice(0.0)
        with self._lock:
            self._running -= 1
            if not self._running:
                sys.setswitchinterval(self._before_s)


SWITCH_INTERVAL = SwitchInterval()

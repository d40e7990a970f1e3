"""How well the control loop keeps its time, measured by the times of its ticks alone."""

from collections import deque

import numpy as np

from gazerig.robot.model.types import LoopFigures

OVER_S = 5.0
"""How far back the figures reach."""


class LoopTiming:
    """Figures of the last seconds.

    A tick that comes late shows twice, as a long wait and a short one; slots that were
    skipped are counted as overruns and taken out of the wait.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._rows: deque[tuple[float, float, int]] = deque()
        self._last_s: float | None = None
        self._overruns = 0

    def update(self, t_s: float) -> None:
        """Record the start time of a tick; a time before the last resets the record."""
        last_s, self._last_s = self._last_s, t_s
        if last_s is None or t_s <= last_s:
            self._rows.clear()
            return
        wait_s = t_s - last_s
        slots = max(1, round(wait_s / self._period_s))
        self._rows.append((t_s, abs(wait_s - slots * self._period_s), slots - 1))
        self._overruns += slots - 1
        while t_s - self._rows[0][0] >= OVER_S:
            self._rows.popleft()

    def figures(self) -> LoopFigures | None:
        """Return the figures, None before the second tick."""
        if not self._rows:
            return None
        table = np.array(self._rows)
        spread_s = table[-1, 0] - table[0, 0]
        p50, p99, worst = (1e3 * np.percentile(table[:, 1], (50.0, 99.0, 100.0))).tolist()
        return LoopFigures(
            rate_hz=float((len(table) - 1) / spread_s) if spread_s > 0.0 else 1.0 / self._period_s,
            p50_ms=p50,
            p99_ms=p99,
            worst_ms=worst,
            overruns=int(table[:, 2].sum()),
            overruns_ever=self._overruns,
            over_s=min(OVER_S, float(spread_s)),
        )

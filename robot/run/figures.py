"""Figures of a run, collected tick by tick and returned as one JSON object at the end."""

from collections import Counter, defaultdict
from math import degrees, inf, radians

import numpy as np

from gazerig.gaze.angles import add, angle_between, scale, sub, unit
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Vec3
from gazerig.robot.loop.tick import Tick

_FIXATION_RAD_S = radians(40.0)
"""Largest speed of a fixation; 30 is usual, and a servo step in 20 ms is already 4.4 deg/s."""
_PERIOD_S = 0.02
"""Least time between two samples of the gaze, as those of an eye tracker at 50 Hz."""


class Summary:
    """Counts and shares over a run."""

    def __init__(self) -> None:
        self._target_s: defaultdict[str, float] = defaultdict(float)
        # Counts by thousandths of a degree: a list would grow while the rig runs.
        self._errors_mdeg: Counter[int] = Counter()
        self._first_s: float | None = None
        self._last: Tick | None = None
        self._sampled_s = -inf
        self._gaze: Vec3 | None = None

    def update(self, tick: Tick) -> None:
        """Add one tick."""
        if self._first_s is None:
            self._first_s = tick.t_s
        self._last = tick
        if tick.t_s - self._sampled_s >= _PERIOD_S - 1e-9:
            self._sample(tick)

    def _sample(self, tick: Tick) -> None:
        """Count the target, and the error of the gaze during a fixation."""
        t_s, pose, target = tick.t_s, tick.pose, tick.target
        left, right = line_of_sight(pose, True), line_of_sight(pose, False)
        before, self._gaze = self._gaze, unit(add(left, right))
        dt_s, self._sampled_s = t_s - self._sampled_s, t_s
        if before is None:
            return
        self._target_s[target.kind] += dt_s
        # As in an eye tracker, the speed of the gaze defines a fixation.
        still = angle_between(before, self._gaze) < _FIXATION_RAD_S * dt_s
        if still and tick.gaze.phase != "saccade":
            # Eyes that one linkage turns sideways stay parallel: the remaining error counts too.
            point = add(target.p_world_m, scale(target.v_world_m_s, max(0.0, t_s - target.at_s)))
            off_left = angle_between(left, sub(point, pose.p_world_eye_left_m))
            off_right = angle_between(right, sub(point, pose.p_world_eye_right_m))
            self._errors_mdeg[round(500.0 * degrees(off_left + off_right))] += 1

    def figures(self) -> dict[str, object]:
        """Return the figures of the ticks; the caller adds bus, loop and frames."""
        last, total = self._last, sum(self._target_s.values())
        by_time = sorted(self._target_s.items(), key=lambda item: -item[1])
        return {
            "seconds": round(last.t_s - (self._first_s or 0.0), 6) if last else 0.0,
            "fixations": last.gaze.fixations if last else 0,
            "saccades": last.gaze.saccades if last else 0,
            "blinks": last.gaze.blinks if last else 0,
            "target_share": {name: round(time / total, 4) for name, time in by_time},
            "gaze_error_deg": {
                "median": _percentile_deg(self._errors_mdeg, 50.0),
                "p95": _percentile_deg(self._errors_mdeg, 95.0),
            },
        }


def _percentile_deg(counts_mdeg: Counter[int], percent: float) -> float | None:
    """Return a percentile of counted thousandths of a degree, None without values."""
    if not counts_mdeg:
        return None
    values = sorted(counts_mdeg)
    reached = np.cumsum([counts_mdeg[value] for value in values])
    return values[int(np.searchsorted(reached, percent / 100.0 * reached[-1]))] / 1000.0

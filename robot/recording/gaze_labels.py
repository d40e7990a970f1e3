"""Labels of samples and intervals of a run: saccade, fixation, pursuit, blink.

The labels are not detected: the models report their movement in every tick. The servos follow
the plan with a lag, so the plan is shifted by the lag at which it best fits the measured gaze.
Amplitudes and speeds are measured.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.recording.gaze_angles import MOVEMENTS, GazeAngles, GazeTarget, Ints

LONGEST_LAG_S = 0.1
SHORTEST_PURSUIT_S = 0.1
"""A target's velocity fluctuates about the motion threshold; a shorter pursuit is part of the
movements around it."""

_LAGS_S = np.arange(0.0, LONGEST_LAG_S, 0.001)
_FIXATION, _SACCADE, _PURSUIT = 1, 2, 3


class Labels(NamedTuple):
    """Labels of the measured samples: the columns of GazeAngles, shifted by the lag.

    Attributes:
        lag_s: Time from the plan to its measured motion.
    """

    lag_s: float
    movement: Ints
    blink: NDArray[np.bool_]
    looked_at: Ints

    def event(self) -> list[str]:
        """Return one word per sample: "blink" during a blink, else the movement."""
        labels = np.array(MOVEMENTS, dtype=object)[self.movement]
        return list(np.where(self.blink, "blink", labels))


class LabelledInterval(NamedTuple):
    """One saccade, fixation, pursuit or blink.

    Attributes:
        onset_s: Time since the first tick.
        amplitude_deg: Great circle from the first to the last sample of the measured cyclopean
            gaze, None if it was lost and for a blink.
        peak_deg_s: Highest speed of the measured cyclopean gaze, None as for the amplitude.
        looked_at: Destination of a saccade, else the target that the eyes are on.
    """

    onset_s: float
    duration_s: float
    event: str
    amplitude_deg: float | None
    peak_deg_s: float | None
    looked_at: GazeTarget


def label_samples(trace: GazeAngles) -> Labels:
    """Label the samples of a run."""
    lag_s = estimate_lag(trace)
    source = np.searchsorted(trace.time_s, trace.time_s - lag_s + 1e-9, side="right") - 1
    source = np.maximum(source, 0)
    out, time_s = trace.movement[source], trace.time_s
    # Short pursuits become fixations, and short fixations within a pursuit become pursuit.
    for wanted, other in ((_PURSUIT, _FIXATION), (_FIXATION, _PURSUIT)):
        for first, last in _runs(out):
            if out[first] != wanted or time_s[last] - time_s[first] >= SHORTEST_PURSUIT_S:
                continue
            before = out[first - 1] if first else 0
            after = out[last + 1] if last + 1 < len(out) else 0
            if wanted == _PURSUIT or (before == other and after == other):
                out[first : last + 1] = other
    return Labels(lag_s, out, trace.blink[source], trace.looked_at[source])


def estimate_lag(trace: GazeAngles) -> float:
    """Return the lag of the measured gaze behind the planned one, 0 .. LONGEST_LAG_S.

    It is the lag at which the speeds of both correlate best during and just after saccades.
    Speeds are compared because the gaze may have a constant offset. Saccades are compared
    because all lags fit a gaze at rest equally well.
    """
    jumps = trace.movement == _SACCADE
    if not jumps.any():
        return 0.0
    t = trace.time_s
    planned, seen = speed_deg_s(t, trace.planned_deg), speed_deg_s(t, trace.cyclopean_deg)
    onsets = t[jumps]
    since = t - onsets[np.maximum(np.searchsorted(onsets, t, side="right") - 1, 0)]
    near = (since >= 0.0) & (since <= LONGEST_LAG_S) & np.isfinite(seen)
    if np.count_nonzero(near) < 3 or np.ptp(seen[near]) == 0.0:
        return 0.0
    fits = []
    for lag in _LAGS_S:
        moved = np.interp(t[near] - lag, t, planned)
        # A constant plan has no correlation.
        fits.append(np.corrcoef(moved, seen[near])[0, 1] if np.ptp(moved) > 0.0 else -1.0)
    return float(_LAGS_S[int(np.argmax(fits))])


def find_intervals(trace: GazeAngles, labels: Labels) -> tuple[LabelledInterval, ...]:
    """Return all intervals in the order of their onsets; blinks overlap movements."""
    key = labels.movement * len(trace.names) + labels.looked_at
    # A target that changes during a saccade does not split the saccade.
    key = np.where(labels.movement == _SACCADE, -1, key)
    speed = speed_deg_s(trace.time_s, trace.cyclopean_deg)
    found = [
        _interval(trace, labels, speed, first, last, MOVEMENTS[labels.movement[first]])
        for first, last in _runs(key)
        if labels.movement[first]
    ]
    found += [
        _interval(trace, labels, speed, first, last, "blink")
        for first, last in _runs(labels.blink.astype(np.int64))
        if labels.blink[first]
    ]
    return tuple(sorted(found, key=lambda s: (s.onset_s, s.event)))


def _runs(key: Ints) -> list[tuple[int, int]]:
    """Return first and last index of every run of equal values."""
    breaks = np.flatnonzero(np.diff(key)) + 1
    firsts = [0, *breaks.tolist()]
    return list(zip(firsts, [*(b - 1 for b in breaks.tolist()), len(key) - 1], strict=True))


def _interval(
    trace: GazeAngles, labels: Labels, speed: Floats, first: int, last: int, event: str
) -> LabelledInterval:
    onset_s = float(trace.time_s[first])
    if last + 1 < len(trace.time_s):
        end_s = float(trace.time_s[last + 1])
    else:
        end_s = float(trace.time_s[last]) + 1.0 / trace.rate_hz
    amplitude = _great_circle_deg(trace.cyclopean_deg[first], trace.cyclopean_deg[last])
    peak = float(np.max(speed[first : last + 1]))
    return LabelledInterval(
        onset_s,
        end_s - onset_s,
        event,
        amplitude if event != "blink" and np.isfinite(amplitude) else None,
        peak if event != "blink" and np.isfinite(peak) else None,
        trace.names[labels.looked_at[first]],
    )


def speed_deg_s(time_s: Floats, gaze_deg: Floats) -> Floats:
    """Return the angular speed (n,) of a gaze (n, 2), each over two sample intervals."""
    x, y = gaze_deg.T
    dx, dy = np.gradient(x, time_s), np.gradient(y, time_s)
    speed: Floats = np.hypot(dx * np.cos(np.radians(y)), dy)
    return speed


def _great_circle_deg(a_deg: Floats, b_deg: Floats) -> float:
    """Return the great-circle angle between two directions (x, y)."""
    (xa, ya), (xb, yb) = np.radians(a_deg), np.radians(b_deg)
    # Haversine: exact for small angles.
    h = np.sin((yb - ya) / 2) ** 2 + np.cos(ya) * np.cos(yb) * np.sin((xb - xa) / 2) ** 2
    return float(np.degrees(2.0 * np.arcsin(min(1.0, np.sqrt(h)))))

"""Eyes and head in a gaze shift, the gaze held while the head turns, and smooth pursuit."""

from math import nan

import numpy as np

from gazerig.features.lab.analysis import human_norms as human
from gazerig.features.lab.analysis.event_detector import THRESHOLD_DEG_S
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, median
from gazerig.gaze.types import Floats

LEAST_DEG = 5.0
_AFTER_S, _BEFORE_S, _LEAST_AFTER_S = 0.9, 0.15, 0.45
_SOON_S = 0.5
"""A head movement that starts later does not belong to the shift of the eyes."""

_NEXT_DEG = 8.0
"""A saccade of this size begins another shift."""

_STILL_DEG_S, _STARTS_DEG_S = 10.0, 8.0
_MOVES_DEG = 5.0
_LARGE_DEG = 20.0
_HEAD_DEG_S, _STILL_TARGET_DEG_S = 6.0, 3.0
_HOLDS_S, _FOLLOWS_S = 0.08, 0.15
"""Shortest stretches in which the gaze is held, and in which it follows."""
_ASIDE_DEG = 10.0
SLOWEST_DEG_S, FASTEST_DEG_S = 5.0, 40.0
_HALF = 4
"""Half of the samples over which a speed is measured."""


def speeds(run: GazeTrace, name: str) -> Floats:
    """Return (n, k) speeds of a column by differences over 8 samples, 0 at the ends."""
    t, x = run.column("t"), run.column(name)
    out = np.zeros_like(x)
    if len(x) > 2 * _HALF:
        span = np.maximum(t[2 * _HALF :] - t[: -2 * _HALF], 1e-6)
        out[_HALF:-_HALF] = (x[2 * _HALF :] - x[: -2 * _HALF]) / span[:, None]
    return out


def gaze_shifts(run: GazeTrace) -> Floats:
    """Return (n, 4) of the shifts that began with the head at rest; sideways, along the shift.

    Columns: target from the previous direction of the head, in deg, also for a shift back to it;
    turn of the head until the next shift, .9 s at most; start of the head after that of the eyes,
    in s, NaN if the head did not move with them; peak speed of the head, in deg/s.
    """
    t, head, goal = run.column("t"), run.column("head")[:, 0], run.column("target")[:, 0]
    speed, moves = speeds(run, "head")[:, 0], np.abs(run.column("target_rate")[:, 0])
    large = [s for s in run.saccades if s.amplitude_deg >= LEAST_DEG and s.commanded is not None]
    out = []
    for at, saccade in enumerate(large):
        onset_s = saccade.onset_s
        later = (s.onset_s for s in large[at + 1 :] if s.amplitude_deg >= _NEXT_DEG)
        ends_s = min(onset_s + _AFTER_S, next(later, np.inf))
        window = run.between(onset_s, ends_s)
        landing = run.between(saccade.end_s, saccade.end_s + 0.03)
        if ends_s - onset_s < _LEAST_AFTER_S or not len(t[window]) or not len(t[landing]):
            continue
        if max(abs(speed[window.start]), float(np.median(moves[window]))) > _STILL_DEG_S:
            continue
        # The target, because an eye at the end of its range reaches it only with the head.
        aside = float(np.median(goal[landing]) - head[window.start])
        sign = 1.0 if aside >= 0.0 else -1.0
        turned = sign * float(head[window.stop - 1] - head[window.start])
        around = run.between(onset_s - _BEFORE_S, onset_s + _AFTER_S)
        fast, near = sign * speed[around], t[around]
        moving = np.flatnonzero((fast > _STARTS_DEG_S) & (near < onset_s + _SOON_S))
        after = float(near[moving[0]] - onset_s) if len(moving) and turned >= _MOVES_DEG else nan
        out.append((abs(aside), turned, after, float(fast.max())))
    return np.array(out).reshape(-1, 4)


def vor_gains(run: GazeTrace) -> Floats:
    """Return (n,) gain of the eyes against the head, one row a stretch.

    The required eye motion is the target's motion seen from the head, minus the head's: a near
    target requires more than the head's rotation, which is not an error of the gain.
    """
    gaze, target, head = speeds(run, "gaze"), speeds(run, "target"), speeds(run, "head")[:, :2]
    still = np.hypot(*run.column("target_rate").T)
    turns = np.hypot(*head.T) > _HEAD_DEG_S
    # If the eyes cannot follow a fast head, this motion is part of the shift, short of the target.
    held = run.slow() & (still < _STILL_TARGET_DEG_S) & turns & (run.column("off")[:, 0] < 3.0)
    rows = []
    for part in run.slices(held, _HOLDS_S):
        inner = slice(part.start + _HALF, part.stop - _HALF)
        if inner.stop - inner.start < _HALF:
            continue
        due, done = (target - head)[inner].ravel(), (gaze - head)[inner].ravel()
        if np.abs(done).max() <= THRESHOLD_DEG_S * 5.0:
            rows.append(float(due @ done / (due @ due)))
    return np.array(rows)


def head_rolls(run: GazeTrace) -> Floats:
    """Return (n,) the roll of the head in each fixation of a target to the side, in deg."""
    roll, aside = np.abs(run.column("head")[:, 2]), np.abs(run.column("target")[:, 0])
    parts = [run.between(f.start_s, f.end_s) for f in run.fixations]
    return np.array(
        [np.median(roll[p]) for p in parts if p.stop > p.start and aside[p].mean() > _ASIDE_DEG]
    )


def pursuit_stretches(run: GazeTrace) -> Floats:
    """Return (n, 3) target speed in deg/s, gain, and lag in ms: one row a stretch."""
    at, gaze = run.column("target_rate"), speeds(run, "gaze")
    error = run.column("target") - run.column("gaze")
    speed = np.hypot(*at.T)
    follows = run.slow(0.02, 0.06) & (speed > SLOWEST_DEG_S) & (speed < FASTEST_DEG_S)
    rows = []
    for part in run.slices(follows, _FOLLOWS_S):
        power = float((at[part] ** 2).sum())
        gain = float((gaze[part] * at[part]).sum()) / power
        lag = float((error[part] * at[part]).sum()) / power
        rows.append((float(speed[part].mean()), gain, 1e3 * lag))
    return np.array(rows).reshape(-1, 3)


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of eyes and head, and of pursuit."""
    shifts = gaze_shifts(run)
    beyond = shifts[shifts[:, 0] > human.STAHL_FREE_DEG]
    large = shifts[shifts[:, 0] >= _LARGE_DEG]
    after = 1e3 * shifts[:, 2]
    turns = shifts[shifts[:, 1] >= _MOVES_DEG]
    usual = (4.0 / 3.0 * turns[:, 1] / 50.0 + 0.4) * 60.0
    stretches = pursuit_stretches(run)
    return [
        MeasuredValue("head_slope", beyond, _slope),
        MeasuredValue("head_share", large[:, 1] - human.mean_head_deg(large[:, 0]), median),
        MeasuredValue("head_after", after[np.isfinite(after)], median),
        MeasuredValue("head_peak", turns[:, 3] / usual, median),
        MeasuredValue("head_roll", head_rolls(run), median),
        MeasuredValue("vor", vor_gains(run), median),
        MeasuredValue("pursuit_gain", stretches[:, 1], median),
        MeasuredValue("pursuit_lag", stretches[:, 2], median),
    ]


def _slope(rows: Floats) -> float:
    """Return degrees of head movement per degree beyond the eyes' own range."""
    beyond = rows[:, 0] - human.STAHL_FREE_DEG
    return float(beyond @ rows[:, 1] / (beyond @ beyond))

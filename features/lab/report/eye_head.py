"""Shares of eyes and head in a gaze shift, and stability of the gaze while the head turns."""

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
_STRETCH_S = 0.08
_ASIDE_DEG = 10.0


class Shift(NamedTuple):
    """One gaze shift and the head's motion in it; sideways angles, along the shift.

    aside_deg: target from the previous direction of the head; also for a shift back to it
    head_deg: turn of the head until the next shift, 0.9 s at most
    head_after_s: start of the head after that of the eyes, nan if the head did not move with them
    """

    aside_deg: float
    head_deg: float
    head_after_s: float
    head_peak_deg_s: float


def angular_rates(t_s: Floats, x: Floats, half: int = 4) -> Floats:
    """Return a speed by differences over 2 x ``half`` samples, 0 at the ends."""
    out = np.zeros_like(x)
    if len(x) > 2 * half:
        span = np.maximum(t_s[2 * half :] - t_s[: -2 * half], 1e-6)
        out[half:-half] = (x[2 * half :] - x[: -2 * half]) / span
    return out


def gaze_shifts(run: GazeTrace) -> list[Shift]:
    """Return the shifts that began with the head at rest."""
    t, head, goal = run.column("t"), run.column("head_yaw"), run.column("target_yaw")
    speed, moves = angular_rates(t, head), np.abs(run.column("target_yaw_rate"))
    large = [s for s in run.saccades if s.amplitude_deg >= LEAST_DEG and s.commanded is not None]
    out = []
    for at, saccade in enumerate(large):
        later = (s.onset_s for s in large[at + 1 :] if s.amplitude_deg >= _NEXT_DEG)
        ends_s = min(saccade.onset_s + _AFTER_S, next(later, np.inf))
        window = run.between(saccade.onset_s, ends_s)
        landing = run.between(saccade.end_s, saccade.end_s + 0.03)
        if ends_s - saccade.onset_s < _LEAST_AFTER_S or not len(t[window]) or not len(t[landing]):
            continue
        if (
            abs(speed[window.start]) > _STILL_DEG_S
            or float(np.median(moves[window])) > _STILL_DEG_S
        ):
            continue
        # The target, because an eye at the end of its range reaches it only with the head.
        aside = float(np.median(goal[landing]) - head[window.start])
        sign = 1.0 if aside >= 0.0 else -1.0
        turned = sign * float(head[window.stop - 1] - head[window.start])
        onset_s = saccade.onset_s
        around = run.between(onset_s - _BEFORE_S, onset_s + _AFTER_S)
        fast, near = sign * speed[around], t[around]
        moving = np.flatnonzero((fast > _STARTS_DEG_S) & (near < onset_s + _SOON_S))
        after = float(near[moving[0]] - onset_s) if len(moving) and turned >= _MOVES_DEG else nan
        out.append(Shift(abs(aside), turned, after, float(fast.max())))
    return out


def stable_stretches(
    mask: NDArray[np.bool_], t_s: Floats, shift: Floats, least_s: float
) -> list[slice]:
    """Return the runs of rows with a true ``mask`` and an unchanged target."""
    edges = np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0))
    out = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        breaks = np.flatnonzero(np.diff(shift[first:last])) + first + 1
        for a, b in zip((first, *breaks), (*breaks, last), strict=True):
            if b - a > 2 and t_s[b - 1] - t_s[a] >= least_s:
                out.append(slice(int(a), int(b)))
    return out


def vor_gains(run: GazeTrace) -> Floats:
    """Return (n, 2) gain of the eyes against the head and the head's speed, one row a stretch.

    The required eye motion is the target's motion seen from the head, minus the head's: a near
    target requires more than the head's rotation, which is not an error of the gain.
    """
    t = run.column("t")
    if len(t) < 20:
        return np.zeros((0, 2))
    names = ("gaze_yaw", "gaze_pitch", "target_yaw", "target_pitch", "head_yaw", "head_pitch")
    gaze_y, gaze_p, at_y, at_p, head_y, head_p = (
        angular_rates(t, run.column(name)) for name in names
    )
    still = np.hypot(run.column("target_yaw_rate"), run.column("target_pitch_rate"))
    mask = run.slow() & (still < _STILL_TARGET_DEG_S) & (np.hypot(head_y, head_p) > _HEAD_DEG_S)
    # If the eyes cannot follow a fast head, this motion is part of the shift, short of the target.
    mask &= run.column("off_left") < 3.0
    rows = []
    for part in stable_stretches(mask, t, run.column("shift"), _STRETCH_S):
        inner = slice(part.start + 4, part.stop - 4)
        if inner.stop - inner.start < 4:
            continue
        due = np.concatenate([at_y[inner] - head_y[inner], at_p[inner] - head_p[inner]])
        done = np.concatenate([gaze_y[inner] - head_y[inner], gaze_p[inner] - head_p[inner]])
        if np.abs(done).max() > THRESHOLD_DEG_S * 5.0:
            continue
        rows.append(
            (float(due @ done / (due @ due)), float(np.hypot(head_y, head_p)[inner].mean()))
        )
    return np.array(rows).reshape(-1, 2)


def head_rolls(run: GazeTrace) -> Floats:
    """Return (n,) the roll of the head in each fixation of a target to the side, in deg."""
    roll, aside = np.abs(run.column("head_roll")), np.abs(run.column("target_yaw"))
    parts = [run.between(f.start_s, f.end_s) for f in run.fixations]
    return np.array(
        [np.median(roll[p]) for p in parts if p.stop > p.start and aside[p].mean() > _ASIDE_DEG]
    )


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of eyes and head."""
    shifts = gaze_shifts(run)
    seen = np.array([(s.aside_deg, s.head_deg) for s in shifts]).reshape(-1, 2)
    beyond = seen[seen[:, 0] > human.STAHL_FREE_DEG]
    large = seen[seen[:, 0] >= _LARGE_DEG]
    after = np.array([1e3 * s.head_after_s for s in shifts])
    turns = np.array([(s.head_deg, s.head_peak_deg_s) for s in shifts]).reshape(-1, 2)
    turns = turns[turns[:, 0] >= _MOVES_DEG]
    usual = (4.0 / 3.0 * turns[:, 0] / 50.0 + 0.4) * 60.0
    return [
        MeasuredValue("head_slope", beyond, _slope),
        MeasuredValue("head_share", large[:, 1] - human.mean_head_deg(large[:, 0]), median),
        MeasuredValue("head_after", after[np.isfinite(after)], median),
        MeasuredValue("head_peak", turns[:, 1] / usual, median),
        MeasuredValue("head_roll", head_rolls(run), median),
        MeasuredValue("vor", vor_gains(run)[:, 0], median),
    ]


def _slope(rows: Floats) -> float:
    """Return degrees of head movement per degree beyond the eyes' own range."""
    beyond = rows[:, 0] - human.STAHL_FREE_DEG
    return float(beyond @ rows[:, 1] / (beyond @ beyond))

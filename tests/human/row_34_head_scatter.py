"""No two movements of the head are equal: goal, onset and duration scatter within bounds.

Things in turn 40 deg to the left, ahead, 40 deg to the right and ahead, each as it was before. The
slope of people's heads is .77 +- .16 (Stahl 1999); in a natural task of 27 to 57 deg the head went
first in 48 % of the shifts, with the eye in 37 %, after it in 15 %. Onsets are those of the plan
(phase "saccade", and the head's minimum jerk, extrapolated from 5 and 95 % of its way, where the
sway counts little): servos hide both alike.
"""

from collections.abc import Sequence
from math import cos, sin

import numpy as np
from human.lights import EYES_M, Lights
from human.measured_run import MeasuredRun, Runner
from human.row_16_idle import Room

from gazerig.robot.model.commands import Value

_YAWS = (40, 0, -40, 0)
_EACH_S, _TURNED_S = 2.5, 0.9
_TOGETHER_S = 0.008
_FREE_DEG = 17.9
_WAYS, _AT = (0.05, 0.95), (0.189, 0.811)
"""Shares of a movement by minimum jerk, and of its time until then."""
_SEES_FAR: dict[str, Value] = {"camera.horizontal_field_deg": 140.0}
_KINDS = ("glance", "search", "rest", "light")

WANTED = {
    "equal looks: slope of the head, standard deviation": (0.05, 0.16),
    "equal looks: slope of the head, farthest from the mean": (0.08, 0.35),
    "equal looks: duration, coefficient of variation": (0.05, 0.35),
    "equal looks: head less eye onset, standard deviation, ms": (10.0, 80.0),
    "natural shifts: head first, %": (35.0, 60.0),
    "natural shifts: eye first, %": (5.0, 45.0),
}


SCENE = Lights("equal-lights", _YAWS, _EACH_S)
_WIDE = np.radians([-56.0, -28.0, 0.0, 28.0, 56.0])
WIDE = Room("wide-room", [(1.5 * cos(yaw), 1.5 * sin(yaw), EYES_M[2]) for yaw in _WIDE.tolist()])
"""Things so far apart that many looks are as large as in that task."""


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return how the figures of equal looks scatter, and who goes first in natural ones."""
    lit: dict[str, Value] = {"gaze.top_down.rules.wait.look_at": "light", **_SEES_FAR}
    equal = np.concatenate(
        [_shifts(run(SCENE, seed=n, seconds=seconds, overrides=lit)) for n in seeds]
    )
    natural = np.concatenate(
        [_shifts(run(WIDE, seed=n, seconds=seconds, overrides=_SEES_FAR)) for n in seeds]
    )
    out = equal[equal[:, 0] > _FREE_DEG + 8.0]
    slopes = out[:, 1] / (out[:, 0] - _FREE_DEG)
    lag = natural[np.isfinite(natural[:, 3]), 3]
    return {
        "equal looks: slope of the head, standard deviation": float(slopes.std()),
        "equal looks: slope of the head, farthest from the mean": float(
            np.abs(slopes - slopes.mean()).max()
        ),
        "equal looks: duration, coefficient of variation": float(
            np.nanstd(out[:, 2]) / np.nanmean(out[:, 2])
        ),
        "equal looks: head less eye onset, standard deviation, ms": 1e3
        * float(np.nanstd(out[:, 3])),
        "natural shifts: head first, %": 100.0 * float((lag < -_TOGETHER_S).mean()),
        "natural shifts: eye first, %": 100.0 * float((lag > _TOGETHER_S).mean()),
    }


def _shifts(one: MeasuredRun) -> np.ndarray:
    """Return (n, 4) arc, head turned, seconds of the head, head less eye onset (nan: none)."""
    rows, t, goal = [], one.t_s, one.head_goal_deg[:, 0]
    flying = one.phase == "saccade"
    for k in np.flatnonzero(np.diff(one.shift)) + 1:
        done = np.searchsorted(t, t[k] + _TURNED_S)
        if done >= len(t) or (np.diff(one.shift[k:done]) > 0).any():
            continue
        if one.target_name[k].split()[0] not in _KINDS:
            continue
        before = np.searchsorted(t, t[k] - 0.1)
        if abs(goal[k] - goal[before]) > 0.3:
            continue
        turned = abs(goal[done] - goal[k])
        if turned < 3.0:
            continue
        share = np.abs(goal[k:done] - goal[k]) / turned
        early, late = (t[k + np.argmax(share > way)] for way in _WAYS)
        lasts_s = (late - early) / (_AT[1] - _AT[0])
        jump = np.argmax(flying[k:done])
        lag = early - _AT[0] * lasts_s - t[k + jump] if flying[k:done].any() else np.nan
        rows.append((abs(one.target_deg[k, 0] - goal[k]), turned, lasts_s, lag))
    return np.array(rows).reshape(-1, 4)

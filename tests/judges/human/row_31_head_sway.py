"""A head in front of a person never rests: its motion is small, and the gaze keeps its place.

A person who sits still. People sway by 0.2 to 1.5 deg; servos sway quietly if the goal moves by no
more than a step of the encoder in a tick.
"""

import numpy as np
from human.measured_run import BEGIN_S, Figures, MeasuredRun, Runs
from human.row_13_small_motion import ONE_POINT, SCENE

_RESTS_S, _WINDOW_S = 2.0, 10.0
_STEP_DEG = 360.0 / 4096.0
_AXES = ("yaw", "pitch", "roll")

WANTED = {
    "yaw or roll without a step for 2 s or longer, % of time": (0.0, 25.0),
    "longest time without a step of yaw or roll, s": (0.0, 8.0),
    **{f"{axis}: standard deviation, deg": (0.15, 1.5) for axis in _AXES},
    "largest step of a goal in a tick, encoder steps": (0.0, 2.0),
    "gaze off the plan, 95th percentile, deg": (0.0, 0.6),
}


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds, those of the plan without saccades."""
    every = runs(SCENE, begin_s=BEGIN_S, overrides=ONE_POINT)
    rests = [rest for one in every for axis in (0, 2) for rest in unmoved_s(one, axis)]
    lasted_s = sum(np.ptp(one.t_s) for one in every)
    goals = np.concatenate([np.abs(np.diff(one.head_goal_deg, axis=0)) for one in every])
    off = np.concatenate([_off(one) for one in every])
    deviations = np.median([window for one in every for window in _deviations(one)], axis=0)
    return {
        "yaw or roll without a step for 2 s or longer, % of time": 50.0
        * sum(rest for rest in rests if rest >= _RESTS_S)
        / lasted_s,
        "longest time without a step of yaw or roll, s": max(rests),
        **{
            f"{axis}: standard deviation, deg": s for axis, s in zip(_AXES, deviations, strict=True)
        },
        "largest step of a goal in a tick, encoder steps": (goals.max() / _STEP_DEG),
        "gaze off the plan, 95th percentile, deg": np.percentile(off, 95),
    }


def _deviations(one: MeasuredRun) -> np.ndarray:
    """Return the standard deviations in windows of 10 s, (n, 3): few have a recentring."""
    ticks = round(_WINDOW_S / one.period_s)
    starts = range(0, len(one.t_s) - ticks, ticks)
    return np.array([one.head_deg[k : k + ticks].std(axis=0) for k in starts])


def unmoved_s(one: MeasuredRun, axis: int) -> np.ndarray:
    """Return how long each rest between two steps of an encoder of the neck lasted."""
    moved = np.diff(one.head_deg[:, axis]) != 0.0
    at_s = np.concatenate(([one.t_s[0]], one.t_s[1:][moved], [one.t_s[-1]]))
    return np.diff(at_s)


def _off(one: MeasuredRun) -> np.ndarray:
    """Return the measured gaze off the planned one, outside saccades and their landings."""
    flying = (one.phase == "saccade").astype(int)
    rests = np.convolve(flying, np.ones(20), "full")[: len(flying)] == 0
    return np.linalg.norm(one.gaze_deg - one.plan_deg, axis=1)[rests]

"""The head's share: Stahl's law outward and homeward, and its roll with lateral targets.

Things appear at angles of -55 to 55 deg, each far enough from the last that the head may join in.
Seen from where the head points, 0.77 of what exceeds 17.9 deg is the head's (Stahl 1999; slope
+-.16 between people); within that range it stays. Measured neck, 0.75 s after the shift began.
"""

from collections.abc import Sequence

import numpy as np
from human.lights import Lights
from human.measured_run import BEGIN_S, MeasuredRun, Runner

_YAWS = (0, 25, 0, -35, -25, 45, 30, -20, -55, -45, 0, 14, 5, -30, 55, 40, -40, -10, 20, 50)
_EACH_S = 2.5
_TURNED_S = 0.75
_FREE_DEG = 17.9
_MARGIN_DEG = 1.5
_SEARCHED = ("search", "glance", "rest")
"""Looks about after a light has gone: many from one place, in which the head relieves the eyes."""

WANTED = {
    "outward: degrees of head a degree beyond the eye-only range": (0.61, 0.93),
    "homeward: degrees of head a degree beyond the eye-only range": (0.61, 0.93),
    "within the range: head, deg, at most": (0.0, 1.5),
    "roll with targets 20 deg or more aside, deg, median": (1.0, 4.0),
    "roll to the side of the target, %": (95.0, 100.0),
}


SCENE = Lights("lights", _YAWS, _EACH_S)


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return slopes, the head's motion within the range, and the roll."""
    rows = np.concatenate([_shifts(_of(run, seed, seconds)) for seed in seeds])
    arc, turned, homeward, aside, roll = rows.T
    beyond = arc > _FREE_DEG + _MARGIN_DEG
    within = np.abs(turned[arc < _FREE_DEG - _MARGIN_DEG])
    lateral = (np.abs(aside) >= 20.0) & beyond
    inclined = -np.sign(aside[lateral]) * roll[lateral]
    return {
        "outward: degrees of head a degree beyond the eye-only range": _slope(
            rows[beyond & (homeward == 0.0)]
        ),
        "homeward: degrees of head a degree beyond the eye-only range": _slope(
            rows[beyond & (homeward == 1.0)]
        ),
        "within the range: head, deg, at most": float(within.max()) if len(within) else np.nan,
        "roll with targets 20 deg or more aside, deg, median": float(np.median(inclined)),
        "roll to the side of the target, %": 100.0 * float((inclined > 0.0).mean()),
    }


def _of(run: Runner, seed: int, seconds: float) -> MeasuredRun:
    return run(
        SCENE,
        seed=seed,
        seconds=seconds,
        begin_s=BEGIN_S,
        overrides={
            "gaze.top_down.rules.wait.look_at": "light",
            "camera.horizontal_field_deg": 140.0,  # so that far ones are seen
        },
    )


def _slope(rows: np.ndarray) -> float:
    beyond = rows[:, 0] - _FREE_DEG
    return float(beyond @ rows[:, 1] / (beyond @ beyond)) if len(rows) else float("nan")


def _shifts(one: MeasuredRun) -> np.ndarray:
    """Return (n, 5) arc from the head, turned in it, whether homeward, where to, roll; degrees."""
    rows = []
    starts = np.flatnonzero(np.diff(one.shift)) + 1
    for k in starts:
        done = np.searchsorted(one.t_s, one.t_s[k] + _TURNED_S)
        before = np.searchsorted(one.t_s, one.t_s[k] - 0.1)
        if done >= len(one.t_s) or (np.diff(one.shift[k:done]) > 0).any():
            continue
        yaw = one.head_deg[:, 0]
        if abs(yaw[k] - yaw[before]) > 0.5 or one.target_name[k].split()[0] in _SEARCHED:
            continue
        goes, sign = one.target_deg[k, 0], np.sign(one.target_deg[k, 0] - yaw[k])
        rows.append(
            (
                abs(goes - yaw[k]),
                sign * (yaw[done] - yaw[k]),
                float(abs(goes) < abs(yaw[k])),
                goes,
                one.head_deg[done, 2],
            )
        )
    return np.array(rows).reshape(-1, 5)

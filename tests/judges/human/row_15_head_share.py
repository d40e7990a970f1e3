"""The head's share: Stahl's law outward and homeward, and its roll with lateral targets.

Things appear at angles of -55 to 55 deg, each far enough from the last that the head may join in.
Seen from where the head points, 0.77 of what exceeds 17.9 deg is the head's (Stahl 1999; slope
+-.16 between people); within that range it stays. Measured neck, 0.75 s after the shift began.
"""

from collections.abc import Sequence
from math import cos, radians, sin

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import BEGIN_S, Figures, MeasuredRun, Runs

from gazerig.gaze.types import Vec3
from gazerig.robot.model.commands import Value
from gazerig.sim_mock.scenes.scene import Thing

EYES_M: Vec3 = (0.04, 0.0, 0.13)


def at_yaw(yaw_deg: float) -> Vec3:
    """Return a place 1.5 m from the eyes."""
    x, y, z = EYES_M
    return (x + 1.5 * cos(radians(yaw_deg)), y + 1.5 * sin(radians(yaw_deg)), z)


class Lights(EmptyScene):
    """Things that are there for equal times, one after the other."""

    def __init__(self, name: str, yaws_deg: Sequence[float], each_s: float) -> None:
        self.name, self.round_s = name, each_s * len(yaws_deg)
        self._yaws_deg, self._each_s = yaws_deg, each_s

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the lit one."""
        number = int(t_s / self._each_s)
        yaw_deg = self._yaws_deg[number % len(self._yaws_deg)]
        return (Thing(number, "light", at_yaw(yaw_deg), 0.05),)


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


def measure(runs: Runs) -> Figures:
    """Return slopes, the head's motion within the range, and the roll."""
    overrides: dict[str, Value] = {
        "gaze.top_down.rules.wait.look_at": "light",
        "camera.horizontal_field_deg": 140.0,  # so that far ones are seen
    }
    found = runs(SCENE, begin_s=BEGIN_S, overrides=overrides)
    rows = np.concatenate([_shifts(one) for one in found])
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
        "within the range: head, deg, at most": within.max() if len(within) else np.nan,
        "roll with targets 20 deg or more aside, deg, median": np.median(inclined),
        "roll to the side of the target, %": 100.0 * (inclined > 0.0).mean(),
    }


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

"""Re-fixations: one to two small saccades a second while one thing is looked at for long.

A person who sits still, looked at as one point, on the rig ``desk`` with byte-true servos. An eye
of the desk rig shows 0.8 deg: nine steps of its encoder, three times its play. Geared up (feetech,
expressive) it is five steps and twice the play; hobby servos (maker) move for no less than .4 deg
and stop as much short, so nothing moves there.
"""

import numpy as np
from human.measured_run import BEGIN_S, Figures, Runs

from gazerig.config.schema import load_rig
from gazerig.robot.model.commands import Value

SCENE = "sits-still"
ONE_POINT: dict[str, Value] = {
    "gaze.scanpath.model": "face_tracking",
    "gaze.looks_away": "none",
}

WANTED = {
    "re-fixations a second": (0.8, 2.0),
    "size measured, median, deg": (0.5, 1.5),
    "size measured, 5th percentile, deg": (0.4, 1.5),
    "size measured, 95th percentile, deg": (0.5, 1.8),
    "farthest from the middle, 95th percentile, deg": (0.0, 1.6),
    "hobby servos, re-fixations": (0.0, 0.0),
}


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    sizes, off, lasted_s = [], [], 0.0
    for one in runs(SCENE, begin_s=BEGIN_S, overrides=ONE_POINT):
        after = one.t_s > one.t_s[0] + 1.0
        flight = (one.phase == "saccade") & after
        begins = np.flatnonzero(flight[1:] & ~flight[:-1]) + 1
        ends = np.flatnonzero(~flight[1:] & flight[:-1]) + 1
        for begin, end in zip(begins, ends, strict=False):
            if end + 10 < len(one.t_s):
                sizes.append(np.linalg.norm(one.gaze_deg[end + 10] - one.gaze_deg[begin - 1]))
        off.append(np.linalg.norm(one.gaze_deg - one.target_deg, axis=1)[after])
        lasted_s += (one.t_s[-1] - one.t_s[0]) - 1.0
    small = np.array(sizes)
    return {
        "re-fixations a second": len(small) / lasted_s,
        "size measured, median, deg": np.median(small),
        "size measured, 5th percentile, deg": np.percentile(small, 5),
        "size measured, 95th percentile, deg": np.percentile(small, 95),
        "farthest from the middle, 95th percentile, deg": np.percentile(np.concatenate(off), 95),
        "hobby servos, re-fixations": load_rig("maker").gaze.oculomotor.refixations,
    }

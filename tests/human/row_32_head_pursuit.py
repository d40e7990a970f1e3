"""The head pursues a walker together with the eyes.

A face that goes to and fro by 25 deg at .08 Hz, as a person walks up and down. People's heads lag
behind such a target by .1 to .2 s (Daye, Blohm & Lefevre 2012 for the strategy; the lag is the one
of gaze pursuit with the head free). Measured neck.
"""

from collections.abc import Sequence

import numpy as np
from human.measured_run import Runner
from human.row_01_pursuit import phasor
from human.swinging_face import SwingingFace

SCENE = SwingingFace(0.08, 25.0)
_SETTLED_S = 8.0
_STILL_DEG_S, _OVER_S = 1.0, 0.2

WANTED = {
    "head still, % of time": (0.0, 25.0),
    "head behind the walker, s": (0.0, 0.4),
    "eyes off straight ahead, 95th percentile, deg": (0.0, 15.0),
    "largest eye angle, deg": (0.0, 25.0),
    "head's motion over the walker's": (0.6, 1.1),
}


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return the figures over all seeds."""
    rows = []
    eyes = []
    for seed in seeds:
        one = run(SCENE, seed=seed, seconds=seconds)
        kept = one.t_s > _SETTLED_S
        t, head = one.t_s[kept], one.head_deg[kept, 0]
        step = round(_OVER_S / float(np.median(np.diff(t))))
        speed = np.abs(head[step:] - head[:-step]) / _OVER_S
        moved, walked = (
            phasor(one.t_s, x[:, 0], SCENE.hz, kept)
            for x in (one.head_deg, one.truth_deg("face 0"))
        )
        ratio = moved / walked
        behind_s = -np.angle(ratio) / (2.0 * np.pi * SCENE.hz)
        rows.append((100.0 * (speed < _STILL_DEG_S).mean(), behind_s, abs(ratio)))
        eyes.append(np.abs(one.eyes_deg[kept, :, 0].mean(axis=1)))
    still, lag, gain = np.mean(rows, axis=0)
    off = np.concatenate(eyes)
    return {
        "head still, % of time": float(still),
        "head behind the walker, s": float(lag),
        "eyes off straight ahead, 95th percentile, deg": float(np.percentile(off, 95)),
        "largest eye angle, deg": float(off.max()),
        "head's motion over the walker's": float(gain),
    }

"""Motion that is not a sine is never outrun, and saccades catch up with it.

A face goes to and fro at constant speed. People's smooth gain is .90 to .95 at 20 to 30 deg/s, the
gaze is behind, and catch-up saccades close the gap (Robinson, Gordon & Gordon 1986; de Brouwer et
al. 2002). Smooth gaze only, and not the .4 s about a reversal.
"""

from math import asin, pi, sin

import numpy as np
from human.measured_run import Figures, Runs
from human.row_01_pursuit import ON_ONE_POINT, smooth
from human.swinging_face import SwingingFace

from gazerig.sim_mock.scenes.scene import ScenePerson

_SPEEDS_DEG_S = (10.0, 20.0, 30.0)
_HALF_DEG, _SETTLED_S, _TURN_TICKS = 14.0, 6.0, 81

WANTED = {
    **{f"{speed:g} deg/s: gain": (0.85, 1.0) for speed in _SPEEDS_DEG_S},
    "20 and 30 deg/s: gaze ahead of the face, % of time": (0.0, 40.0),
    "20 and 30 deg/s: median lead, deg": (-3.0, 0.0),
    "20 and 30 deg/s: catch-up saccades a second": (0.3, 4.0),
}


class ToAndFro(SwingingFace):
    """The face goes at one speed between two turns."""

    def __init__(self, deg_s: float) -> None:
        super().__init__(deg_s / (4.0 * _HALF_DEG), _HALF_DEG)
        self.name = f"a face goes to and fro at {deg_s:g} deg/s"

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person."""
        even = 2.0 / pi * asin(sin(2.0 * pi * self.hz * t_s))
        quarter = asin(even) / (2.0 * pi * self.hz)
        return super().people(quarter)


def measure(runs: Runs) -> Figures:
    """Return gains by speed, the phase lead and the saccades, over all seeds."""
    gains, leads, rate = {}, [], []
    for speed in _SPEEDS_DEG_S:
        scene, found = ToAndFro(speed), []
        for one in runs(scene, most_s=60.0, overrides=ON_ONE_POINT):
            face, gaze = one.truth_deg("face 0")[:, 0], one.gaze_deg[:, 0]
            v_face, v_gaze = np.gradient(face, one.t_s), np.gradient(gaze, one.t_s)
            left = np.sign(v_face)
            near = (
                np.convolve(np.abs(np.diff(left, prepend=left[0])), np.ones(_TURN_TICKS), "same")
                > 0.0
            )
            kept = smooth(one) & (one.t_s > _SETTLED_S) & ~near
            found.append((v_gaze[kept] * left[kept]).mean() / np.abs(v_face[kept]).mean())
            if speed >= 20.0:
                leads.append(((gaze - face) * left)[kept])
                late = one.t_s > _SETTLED_S
                rate.append(np.ptp(one.saccades[late]) / np.ptp(one.t_s[late]))
        gains[f"{speed:g} deg/s: gain"] = np.mean(found)
    lead = np.concatenate(leads)
    return {
        **gains,
        "20 and 30 deg/s: gaze ahead of the face, % of time": 100.0 * (lead > 0.0).mean(),
        "20 and 30 deg/s: median lead, deg": np.median(lead),
        "20 and 30 deg/s: catch-up saccades a second": np.mean(rate),
    }

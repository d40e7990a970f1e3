"""A swinging face is followed with a person's gain, at no frequency with more than 1.03.

From picture to joints: tracker, prediction, pursuit, byte-true servos. The gaze stays on one point
of the face, so that its following and not its wandering is measured; saccades are left out.
"""

from typing import NamedTuple

import numpy as np
from human.measured_run import Figures, MeasuredRun, Runs
from human.swinging_face import SwingingFace

from gazerig.robot.model.commands import Value

WANTED = {
    "gain at .1 Hz": (0.98, 1.03),
    "gain at .5 Hz": (0.95, 1.03),
    "gain at .7 Hz": (0.92, 1.03),
    "gain at 1 Hz": (0.85, 1.0),
    "largest gain, .1 to 2 Hz": (0.0, 1.03),
    "fastest smooth gaze, deg/s": (0.0, 63.0),
}

ON_ONE_POINT: dict[str, Value] = {
    "gaze.scanpath.model": "face_tracking",
    "gaze.looks_away": "none",
}
_NAMED = {0.1: ".1", 0.5: ".5", 0.7: ".7", 1.0: "1", 1.5: "1.5"}
_BETWEEN = (0.2, 0.3, 0.4, 0.6, 0.85, 1.25, 2.0)
_SETTLED_S = 6.0
_AROUND_S = (0.02, 0.08)
_SPEED_OVER_S = 0.03


class Following(NamedTuple):
    """Gain of the smooth gaze against the face, and its highest speed."""

    gain: float
    fastest_deg_s: float


def smooth(run: MeasuredRun) -> np.ndarray:
    """Return which ticks are neither in a saccade nor just before or after one, (n,)."""
    jumps = run.phase == "saccade"
    rate_hz = 1.0 / run.period_s
    before, after = (round(s * rate_hz) for s in _AROUND_S)
    near = np.convolve(jumps, np.ones(before + after + 1))[before : before + len(jumps)]
    return np.asarray(near < 0.5)


def following(runs: Runs, hz: float) -> list[Following]:
    """Return for each seed how a face that swings at a frequency is followed."""
    most_s = max(_SETTLED_S + 8.0 / hz, 16.0) if hz > 0.15 else 26.0
    scene = SwingingFace(hz)
    return [_followed(one, hz) for one in runs(scene, most_s=most_s, overrides=ON_ONE_POINT)]


def _followed(seen: MeasuredRun, hz: float) -> Following:
    t, kept = seen.t_s, smooth(seen) & (seen.t_s > _SETTLED_S)
    gaze, face = seen.gaze_deg[:, 0], seen.truth_deg("face 0")[:, 0]
    response = phasor(t, np.gradient(gaze, t), hz, kept) / phasor(t, np.gradient(face, t), hz, kept)
    step = round(_SPEED_OVER_S / float(np.median(np.diff(t))))
    speed = np.abs(gaze[step:] - gaze[:-step]) / (t[step:] - t[:-step])
    calm = np.convolve(~kept, np.ones(step + 1))[step : len(kept)] < 0.5
    return Following(abs(response), speed[calm].max())


def measure(runs: Runs) -> Figures:
    """Return gains by frequency, the mean over all seeds, and the highest speed."""
    rows = {hz: following(runs, hz) for hz in _NAMED}
    out: Figures = {
        f"gain at {name} Hz": np.mean([row.gain for row in rows[hz]]) for hz, name in _NAMED.items()
    }
    every = [row for each in rows.values() for row in each]
    every += [following(runs.first, hz)[0] for hz in _BETWEEN]
    out["largest gain, .1 to 2 Hz"] = max(row.gain for row in every)
    out["fastest smooth gaze, deg/s"] = max(row.fastest_deg_s for row in every)
    return out


def phasor(t: np.ndarray, x: np.ndarray, hz: float, kept: np.ndarray) -> complex:
    """Return the sine of a frequency in a signal, as a complex amplitude."""
    w = 2.0 * np.pi * hz
    base = np.column_stack([np.sin(w * t), np.cos(w * t), np.ones_like(t)])[kept]
    s, c, _ = np.linalg.lstsq(base, x[kept], rcond=None)[0]
    return complex(s, c)

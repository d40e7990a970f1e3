"""The head stays where its law put it, and recentres slowly, at random and seldom.

Things appear at angles to both sides and stay for 12 s. Stahl (1999): the head does .77 of what is
beyond 17.9 deg, and the eyes stay within their range, off the middle, as long as the look lasts.
"""

from collections.abc import Sequence

import numpy as np
from human.lights import Lights
from human.measured_run import MeasuredRun, Runner

_YAWS = (0, 35, -15, 40, 0, -45, -20, 30, -25, 15)
_EACH_S, _LATE_S = 12.0, 3.0
_FREE_DEG, _SLOPE = 17.9, 0.77
_MOVED_DEG = 3.0

WANTED = {
    "slope after 3 s, degrees of head a degree beyond the range": (0.61, 0.93),
    "within the range: head after 3 s, deg, median": (0.0, 1.5),
    "recentrings a minute of eccentric looks": (0.5, 8.0),
    "delay of recentring, coefficient of variation": (0.25, 2.0),
    "peak speed of recentring, deg/s, median": (1.0, 20.0),
    "eyes off straight ahead at the end of a look, deg, median": (6.0, 17.9),
}


SCENE = Lights("long-looks", _YAWS, _EACH_S)


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return slope, recentrings and the eyes at the end of a look, over all seeds."""
    runs = [
        run(
            SCENE,
            seed=seed,
            seconds=seconds,
            overrides={
                "gaze.top_down.rules.wait.look_at": "light",
                "camera.horizontal_field_deg": 140.0,
                "gaze.attention.habituation.rule_floor": 1.0,  # so that the look lasts
            },
        )
        for seed in seeds
    ]
    looks = [look for one in runs for look in _looks(one)]
    arc, turned, end = (np.array([look[i] for look in looks]) for i in range(3))
    beyond = arc > _FREE_DEG + 1.5
    delays = [d for look in looks for d in look[3]]
    peaks = [p for look in looks for p in look[4]]
    eccentric_min = sum(look[5] for look in looks) / 60.0
    return {
        "slope after 3 s, degrees of head a degree beyond the range": float(
            (arc[beyond] - _FREE_DEG)
            @ turned[beyond]
            / ((arc[beyond] - _FREE_DEG) @ (arc[beyond] - _FREE_DEG))
        ),
        "within the range: head after 3 s, deg, median": float(
            np.median(np.abs(turned[arc < _FREE_DEG - 1.5]))
        ),
        "recentrings a minute of eccentric looks": len(delays) / eccentric_min,
        "delay of recentring, coefficient of variation": float(np.std(delays) / np.mean(delays))
        if delays
        else np.nan,
        "peak speed of recentring, deg/s, median": float(np.median(peaks)) if peaks else np.nan,
        "eyes off straight ahead at the end of a look, deg, median": float(
            np.median(end[arc > _FREE_DEG])
        ),
    }


def _looks(one: MeasuredRun) -> list[tuple[float, float, float, list[float], list[float], float]]:
    """Return arc, head turned after 3 s, eye at the end, recentrings (delays, peaks), and seconds.

    A recentring is 3 deg or more of head in 0.6 s, later than 1.2 s in the look.
    """
    out = []
    yaw, t = one.head_deg[:, 0], one.t_s
    starts = [*(np.flatnonzero(np.diff(one.shift)) + 1), len(t) - 1]
    for k, end in zip(starts, starts[1:], strict=False):
        if t[end] - t[k] < 8.0 or not one.target_name[k].startswith("light"):
            continue
        goes = one.target_deg[k, 0]
        late = np.searchsorted(t, t[k] + _LATE_S)
        sign = np.sign(goes - yaw[k])
        span = t[k:end]
        smooth = np.convolve(yaw[k:end], np.ones(40) / 40.0, "same")
        speed = np.abs(np.gradient(smooth, span))
        moves = (speed > 3.0) & (span > t[k] + 1.2) & (span < t[end] - 0.3)
        edges = np.flatnonzero(np.diff(moves.astype(int), prepend=0, append=0))
        delays, peaks = [], []
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            if abs(smooth[b - 1] - smooth[a]) > 1.5:
                delays.append(float(span[a] - t[k]))
                peaks.append(float(speed[a:b].max()))
        out.append(
            (
                abs(goes - yaw[k]),
                float(sign * (yaw[late] - yaw[k])),
                float(abs(one.target_deg[end - 1, 0] - yaw[end - 1])),
                delays,
                peaks,
                float(t[end] - t[k]) if abs(goes - yaw[k]) > _FREE_DEG else 0.0,
            )
        )
    return out

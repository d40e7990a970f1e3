"""Conversion of joint angles over time to a gesture's YAML file, which the rig's loader reads."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gazerig.config.gestures import gesture_name, load_gesture
from gazerig.config.rig import Rig
from gazerig.config.save_text import written
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.gesture.gesture import HEAD_TRACKS, Gesture
from gazerig.gaze.types import Floats
from gazerig.robot.app.rig_limits import lid_spans, limits
from gazerig.robot.model.gesture_fit import FittedGesture, GestureFit, GestureRefused, motions
from gazerig.robot.model.key_frames import GRID_S, fit_keys, smoothed
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.types import GAZE_JOINTS

TOLERANCE_DEG = 0.7
"""Largest distance of the curve through fitted keys from the samples."""
_DENSE_S = 0.09
"""Rows closer than this are samples of a motion, not keys of an animator."""
_LARGEST_S = 60.0
_STILL_DEG = 0.01

Series = tuple[Floats, Floats]
Keys = dict[str, list[tuple[float, float]]]


def gesture_text(rig: Rig, series: Mapping[str, Series], description: str) -> str:
    """Return a gesture as YAML.

    Args:
        rig: the rig whose joints it moves.
        series: times in seconds and angles in degrees, by joint of the rig; a gesture is their
            motion relative to their first angle.
        description: meaning of the gesture.

    Raises:
        SetupError: a joint is not the rig's, the gesture is too long, or nothing moves.
    """
    tracks = {_track(name) for name in rig.names}
    unknown = [name for name in series if _track(name) not in tracks]
    if unknown:
        raise SetupError(
            f"no joint {unknown[0]!r}; there is {', '.join(rig.names)}; rename the column"
        )
    start_s = min(float(times[0]) for times, _ in series.values())
    end_s = max(float(times[-1]) for times, _ in series.values())
    if not GRID_S < end_s - start_s <= _LARGEST_S:
        raise SetupError(
            f"it takes {end_s - start_s:.1f} s: a gesture takes at most {_LARGEST_S:g} s"
        )
    keys: Keys = {}
    for name, (times, angles) in series.items():
        for time_s, value in _keys(rig, name, times, angles, start_s):
            keys.setdefault(_track(name), []).append((time_s, value))
    keys = {track: _mean(found) for track, found in keys.items() if found}
    if not keys:
        raise SetupError(f"nothing moves; movements below {TOLERANCE_DEG:g} deg count as jitter")
    return _text(keys, description)


def write_gesture(
    rig: Rig, name: str, text: str, folder: Path, force: bool
) -> tuple[Path, FittedGesture]:
    """Write a gesture's file and check it against the rig.

    Returns:
        The file, and the gesture fitted to the rig.

    Raises:
        SetupError: the file cannot be written, or the rig cannot perform it.
        gazerig.config.load.ConfigError: the name or the gesture breaks a rule.
    """
    path = folder / f"{name}.yaml"
    gesture_name(str(path))
    write_file(path, text, force)
    try:
        return path, fit_to_rig(rig, load_gesture(path))
    except GestureRefused as refused:
        raise SetupError(f"{path} is written, but {rig.name} cannot do it: {refused}") from None


def fit_to_rig(rig: Rig, gesture: Gesture) -> FittedGesture:
    """Return a gesture fitted to a rig, from the middle of its ranges.

    Raises:
        gazerig.robot.model.gesture_fit.GestureRefused: the rig cannot perform it.
    """
    bounds = limits(rig.joints)
    middle = np.clip(0.0, [one.low_rad for one in bounds], [one.high_rad for one in bounds])
    fit = GestureFit(rig.names, lid_spans(rig))
    share = rig.gaze.gestures.limit_share
    return fit.fit("", motions(gesture, rig.names), 1.0, middle, bounds, share)


def _track(joint: str) -> str:
    """Return the track of a joint: both eyes have one."""
    if joint.startswith("neck_"):
        return joint.replace("neck", "head")
    if joint.endswith(("eye_pan", "eyes_pan")):
        return "eyes_yaw"
    return "eyes_pitch" if joint.endswith(("eye_tilt", "eyes_tilt")) else joint


def _keys(
    rig: Rig, joint: str, times_s: Floats, angles_deg: Floats, start_s: float
) -> list[tuple[float, float]]:
    """Return the keys of one joint; for a lid, factors of its first opening."""
    dense = len(times_s) > 4 and float(np.median(np.diff(times_s))) < _DENSE_S
    values = angles_deg - angles_deg[0]
    if np.abs(values).max() <= _STILL_DEG:
        return []
    if dense:
        times, values = fit_keys(*smoothed(times_s, values), TOLERANCE_DEG)
        times = times + float(times_s[0]) - start_s
    else:
        times = times_s - start_s
    if joint in LIDS:
        first_deg = float(angles_deg[0])
        shut, wide = rig.lid_joints.ends_deg(joint)
        if shut is None or wide is None:
            raise SetupError(f"{joint}: the rig does not define its shut and open angles")
        opening = (first_deg - shut) / (wide - shut)
        if opening < 0.2:
            raise SetupError(f"{joint}: it begins nearly shut; begin with open lids")
        values = np.clip(1.0 + values / (wide - shut) / opening, 0.0, 3.0)
    pairs = {round(float(t) / GRID_S): float(v) for t, v in zip(times, values, strict=True)}
    return [(round(k * GRID_S, 3), round(v, 3)) for k, v in pairs.items() if k > 0]


def _mean(keys: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return keys in the order of their times; two joints of one track are averaged."""
    at: dict[float, list[float]] = {}
    for time_s, value in sorted(keys):
        at.setdefault(time_s, []).append(value)
    return [(time_s, round(sum(them) / len(them), 3)) for time_s, them in at.items()]


def _text(keys: Keys, description: str) -> str:
    """Return the YAML of a gesture in joint space."""
    frames: dict[float, dict[str, float]] = {}
    for track, found in keys.items():
        for time_s, value in found:
            frames.setdefault(time_s, {})[track] = value
    lines = [f"description: {written(description)}", "space: joint", "fit: slow", "frames:"]
    lines += [f"  - {{{', '.join(_frame(t, frames[t]))}}}" for t in sorted(frames)]
    return "\n".join(lines) + "\n"


def _frame(time_s: float, values: Mapping[str, float]) -> list[str]:
    own = [
        f"{n}_deg: {v}" for n, v in values.items() if n in (*HEAD_TRACKS, "eyes_yaw", "eyes_pitch")
    ]
    lids = [f"{n}: {v}" for n, v in values.items() if n in LIDS]
    others = [
        f"{n}: {v}"
        for n, v in values.items()
        if n not in LIDS and not n.startswith(("head_", "eyes_"))
    ]
    assert not any(n in GAZE_JOINTS and n not in LIDS for n in values)
    return [
        f"time_s: {time_s}",
        *own,
        *([f"lids: {{{', '.join(lids)}}}"] if lids else []),
        *([f"joints_deg: {{{', '.join(others)}}}"] if others else []),
    ]

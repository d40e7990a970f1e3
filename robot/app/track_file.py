"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings and from animation programs.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.save_text import format_value
from gazerig.config.tracks import load_track, track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.track.track import HEAD_CHANNELS, Track
from gazerig.gaze.types import Floats
from gazerig.robot.app.rig_limits import lid_spans, limits
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.track_fit import (
    GRID_S,
    FittedTrack,
    TrackFit,
    TrackRefused,
    fit_keys,
    resample,
    smooth,
    track_motions,
)
from gazerig.robot.model.types import GAZE_JOINTS

TOLERANCE_DEG = 0.7
"""Largest distance of the curve through fitted keys from the samples."""
_DENSE_S = 0.09
"""Rows closer than this are samples of a motion, not keys of an animator."""
_LARGEST_S = 60.0
_STILL_DEG = 0.01

Series = tuple[Floats, Floats]
"""Times in seconds and angles in degrees of one joint."""
Keys = dict[str, list[tuple[float, float]]]


def track_text(
    rig: Rig, series: Mapping[str, Series], description: str, tolerance_deg: float | None = None
) -> str:
    """Return a track as YAML.

    Args:
        rig: the rig whose joints it moves.
        series: times in seconds and angles in degrees, by joint of the rig; the track is the
            motion relative to the first angle.
        description: meaning of the track.
        tolerance_deg: distance of the curve from dense samples; None: samples of a hand, whose
            jitter is smoothed first.

    Raises:
        SetupError: a joint does not exist in the rig, the track is too long, or nothing moves.
    """
    channels = {_channel_of_joint(name) for name in rig.names}
    unknown = [name for name in series if _channel_of_joint(name) not in channels]
    if unknown:
        raise SetupError(
            f"no joint {unknown[0]!r}; available: {', '.join(rig.names)}; rename the column"
        )
    start_s = min(float(times[0]) for times, _ in series.values())
    end_s = max(float(times[-1]) for times, _ in series.values())
    if not GRID_S < end_s - start_s <= _LARGEST_S:
        raise SetupError(
            f"it takes {end_s - start_s:.1f} s: a track takes at most {_LARGEST_S:g} s"
        )
    keys: Keys = {}
    for name, (times, angles) in _average_eyes(series).items():
        found = _joint_keys(rig, name, times - start_s, angles, tolerance_deg)
        if found:
            keys[_channel_of_joint(name)] = found
    if not keys:
        raise SetupError(f"nothing moves by more than {tolerance_deg or TOLERANCE_DEG:g} deg")
    frames: dict[float, dict[str, float]] = {}
    for channel, found in keys.items():
        for time_s, value in found:
            frames.setdefault(time_s, {})[channel] = value
    lines = [f"description: {format_value(description)}", "space: joint", "fit: slow", "frames:"]
    lines += [f"  - {{{', '.join(_frame_lines(t, frames[t]))}}}" for t in sorted(frames)]
    return "\n".join(lines) + "\n"


def write_track(
    rig: Rig, name: str, text: str, folder: Path, force: bool
) -> tuple[Path, FittedTrack]:
    """Write a track's file and check it against the rig.

    Returns:
        The file, and the track fitted to the rig.

    Raises:
        SetupError: the file cannot be written, or the rig cannot play it.
        gazerig.config.load.ConfigError: the name or the track breaks a rule.
    """
    path = folder / f"{name}.yaml"
    track_name(str(path))
    write_file(path, text, force)
    try:
        return path, fit_to_rig(rig, load_track(path))
    except TrackRefused as refused:
        raise SetupError(f"{path} is written, but {rig.name} cannot play it: {refused}") from None


def fit_to_rig(rig: Rig, track: Track) -> FittedTrack:
    """Return a track fitted to a rig, from the middle of its ranges.

    Raises:
        gazerig.robot.model.track_fit.TrackRefused: the rig cannot play it.
    """
    bounds = limits(rig.joints)
    middle = np.clip(0.0, [one.low_rad for one in bounds], [one.high_rad for one in bounds])
    fit = TrackFit(rig.names, lid_spans(rig))
    share = rig.gaze.tracks.limit_share
    return fit.fit("", track_motions(track, rig.names), 1.0, middle, bounds, share)


def _channel_of_joint(joint: str) -> str:
    """Return the channel of a joint: both eyes have one."""
    if joint.startswith("neck_"):
        return joint.replace("neck", "head")
    if joint.endswith(("eye_pan", "eyes_pan")):
        return "eyes_yaw"
    return "eyes_pitch" if joint.endswith(("eye_tilt", "eyes_tilt")) else joint


def _average_eyes(series: Mapping[str, Series]) -> dict[str, Series]:
    """Return the series with one of both eyes for each axis, their mean."""
    found: dict[str, Series] = {}
    for name, (times, angles) in series.items():
        same = [one for one in found if _channel_of_joint(one) == _channel_of_joint(name)]
        if same:
            there_s, there = found.pop(same[0])
            both_s = np.union1d(there_s, times)
            first, second = np.interp(both_s, there_s, there), np.interp(both_s, times, angles)
            times, angles = both_s, 0.5 * (first + second)
        found[name] = times, angles
    return found


def _joint_keys(
    rig: Rig, joint: str, times_s: Floats, angles_deg: Floats, tolerance_deg: float | None
) -> list[tuple[float, float]]:
    """Return the keys of one joint; for a lid, factors of its first opening."""
    dense = len(times_s) > 4 and float(np.median(np.diff(times_s))) < _DENSE_S
    values = angles_deg - angles_deg[0]
    if np.abs(values).max() <= _STILL_DEG:
        return []
    times = times_s
    if dense:
        samples = (smooth if tolerance_deg is None else resample)(times_s, values)
        times, values = fit_keys(*samples, tolerance_deg or TOLERANCE_DEG)
        times = times + float(times_s[0])
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


def _frame_lines(time_s: float, values: Mapping[str, float]) -> list[str]:
    own = [
        f"{n}_deg: {v}"
        for n, v in values.items()
        if n in (*HEAD_CHANNELS, "eyes_yaw", "eyes_pitch")
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

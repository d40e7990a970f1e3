"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings and from animation programs.
"""

from collections.abc import Mapping
from math import ceil, radians
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.save_text import format_value
from gazerig.config.tracks import load_track, track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.track.track import HEAD_CHANNELS, MAX_DURATION_S, MAX_FRAMES, Track
from gazerig.gaze.types import Floats
from gazerig.robot.app.rig_limits import animation_tables, lid_spans, limits
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.motion_keys import GRID_S, fit_keys, resample, smooth
from gazerig.robot.model.track_fit import (
    FittedTrack,
    TrackFit,
    TrackRefused,
    channel_of_joint,
    shortest_move_s,
    track_motions,
)
from gazerig.robot.model.types import GAZE_JOINTS

TOLERANCE_DEG = 0.7
"""Largest distance of the curve through fitted keys from the samples."""
_DENSE_S = 0.09
"""Rows closer than this are samples of a motion, not keys of an animator."""
_RETURN_S = 0.4
"""Default of return_s."""
_STILL_DEG = 0.01

Series = tuple[Floats, Floats]
"""Times in seconds and angles in degrees of one joint."""
Keys = dict[str, list[tuple[float, float]]]


class TrackText(NamedTuple):
    """A track as YAML, and what differs from its source."""

    text: str
    notes: tuple[str, ...] = ()


def track_text(
    rig: Rig,
    series: Mapping[str, Series],
    description: str,
    *,
    tolerance_deg: float | None = None,
    owned: bool = False,
) -> TrackText:
    """Return a track as YAML.

    Args:
        rig: the rig whose joints it moves.
        series: times in seconds and angles in degrees, by joint of the rig.
        description: meaning of the track.
        tolerance_deg: distance of the curve from dense samples; None: samples of a hand, whose
            jitter is smoothed first.
        owned: whether the track owns its joints and gives their angles; otherwise it is the
            motion relative to the first angle, over gaze.

    Raises:
        SetupError: a joint does not exist in the rig, the track is too long, or nothing moves.
    """
    channels = {channel_of_joint(name) for name in rig.names}
    unknown = [name for name in series if channel_of_joint(name) not in channels]
    if unknown:
        raise SetupError(
            f"no joint {unknown[0]!r}; available: {', '.join(rig.names)}; rename the column"
        )
    start_s = min(float(times[0]) for times, _ in series.values())
    end_s = max(float(times[-1]) for times, _ in series.values())
    _check_length(end_s - start_s)
    means, notes = _average_eyes(series)
    keys: Keys = {}
    begins_s = ends_s = 0.0
    for name, (times, angles) in means.items():
        found = _joint_keys(name, times - start_s, angles, tolerance_deg)
        if not owned and not found:
            continue
        rest = _rest_deg(rig, name) if owned else float(angles[0])
        keys[name] = [(0.0, float(angles[0])), *found]
        first, last = (_move_s(rig, name, keys[name][i][1] - rest) for i in (0, -1))
        begins_s, ends_s = max(begins_s, first), max(ends_s, last)
    if not any(len(found) > 1 for found in keys.values()):
        raise SetupError(f"nothing moves by more than {tolerance_deg or TOLERANCE_DEG:g} deg")
    frames: dict[float, dict[str, float]] = {}
    begins_s = GRID_S * (ceil(begins_s / GRID_S) + 1) if begins_s > GRID_S else 0.0
    _check_length(begins_s + end_s - start_s)
    for name, found in keys.items():
        # Equal values at two keys are a rest, from which the motion begins as in its source.
        rests = [(-GRID_S, found[0][1]), found[0]] if begins_s else []
        for time_s, value in (*rests, *found[1:]):
            at_s = round(time_s + begins_s, 3)
            if at_s > 0.0:
                value = _channel_value(rig, name, value, float(means[name][1][0]), owned)
                most = 90.0 if name in GAZE_JOINTS else 180.0
                if abs(value) > most:
                    raise SetupError(
                        f"{name} at {time_s + start_s:.2f} s: {value:.4g} deg, more than the "
                        f"{most:g} deg of any joint: check the unit of the angles"
                    )
                frames.setdefault(at_s, {})[channel_of_joint(name)] = round(value, 3)
    notes += tuple(_lid_note(rig, name, *means[name]) for name in keys if name in LIDS)
    notes = tuple(filter(None, notes))
    if begins_s:
        notes += (f"begins with {begins_s:.2f} s from the neutral pose to its first one",)
    if len(frames) > MAX_FRAMES:
        raise SetupError(
            f"{len(frames):,} frames; a track has at most {MAX_FRAMES:,}: import it with a larger "
            "--tolerance, or in parts"
        )
    owns = ", ".join(name for name in rig.names if name in series)
    lines = [f"description: {format_value(description)}", "fit: slow"]
    lines += [f"owns: [{owns}]" if owned else "space: joint"]
    lines += [f"return_s: {min(ends_s + 0.01, 10.0):.2f}"] if ends_s > _RETURN_S else []
    lines += ["frames:"]
    lines += [f"  - {{{', '.join(_frame_lines(t, frames[t]))}}}" for t in sorted(frames)]
    return TrackText("\n".join(lines) + "\n", notes)


class RigTrack(NamedTuple):
    """A track on a rig, from the middle of its ranges.

    fitted: the track as the rig plays it; None if it cannot
    refused: the reason, "" if it can
    """

    fitted: FittedTrack | None
    refused: str


def write_track(rig: Rig, name: str, text: str, folder: Path, force: bool) -> tuple[Path, RigTrack]:
    """Write a track's file and check it against the rig.

    Returns:
        The file, and the track on the rig.

    Raises:
        SetupError: the file cannot be written.
        gazerig.config.load.ConfigError: the name or the track breaks a rule.
    """
    path = folder / f"{name}.yaml"
    track_name(str(path))
    write_file(path, text, force)
    return path, fit_to_rig(rig, load_track(path))


def fit_to_rig(rig: Rig, track: Track) -> RigTrack:
    """Return a track on a rig."""
    bounds = limits(rig.joints)
    middle = np.clip(0.0, [one.low_rad for one in bounds], [one.high_rad for one in bounds])
    fit = TrackFit(rig.names, lid_spans(rig))
    try:
        made = track_motions(track, rig.names, 0, animation_tables(rig))
        return RigTrack(fit.fit("", made, 1.0, middle, bounds), "")
    except TrackRefused as refused:
        return RigTrack(None, str(refused))


def _check_length(takes_s: float) -> None:
    if not GRID_S < takes_s <= MAX_DURATION_S:
        raise SetupError(
            f"it takes {takes_s:.6g} s: a track takes at most {MAX_DURATION_S:g} s; split it"
        )


def _average_eyes(series: Mapping[str, Series]) -> tuple[dict[str, Series], tuple[str, ...]]:
    """Return the series with one of both eyes for each axis, their mean, and large differences."""
    found: dict[str, Series] = {}
    notes: list[str] = []
    for name, (times, angles) in series.items():
        same = [one for one in found if channel_of_joint(one) == channel_of_joint(name)]
        if same:
            there_s, there = found.pop(same[0])
            both_s = np.union1d(there_s, times)
            first, second = np.interp(both_s, there_s, there), np.interp(both_s, times, angles)
            worst = int(np.abs(first - second).argmax())
            if abs(first[worst] - second[worst]) > TOLERANCE_DEG:
                notes.append(
                    f"{same[0]} and {name} differ by up to {abs(first[worst] - second[worst]):.1f} "
                    f"deg (at {both_s[worst]:.2f} s): both get the mean"
                )
            times, angles = both_s, 0.5 * (first + second)
        found[name] = times, angles
    return found, tuple(notes)


def _joint_keys(
    joint: str, times_s: Floats, angles_deg: Floats, tolerance_deg: float | None
) -> list[tuple[float, float]]:
    """Return the keys of one joint after time 0, on the grid of times; none if it rests."""
    dense = len(times_s) > 4 and float(np.median(np.diff(times_s))) < _DENSE_S
    times, values = times_s, angles_deg
    if np.abs(values - values[0]).max() <= _STILL_DEG:
        return []
    if dense:
        samples = (smooth if tolerance_deg is None else resample)(times_s, values)
        times, values = fit_keys(*samples, tolerance_deg or TOLERANCE_DEG)
        times = times + float(times_s[0])
    pairs = {round(float(t) / GRID_S): float(v) for t, v in zip(times, values, strict=True)}
    return [(round(k * GRID_S, 3), v) for k, v in pairs.items() if k > 0]


def _lid_ends(rig: Rig, joint: str) -> tuple[float, float]:
    """Return the shut and the open angle of a lid in degrees."""
    ends = rig.lid_joints.ends_deg(joint)
    if ends is None:
        raise SetupError(f"{joint}: the rig does not define its shut and open angles")
    return ends


def _lid_note(rig: Rig, joint: str, times_s: Floats, angles_deg: Floats) -> str:
    """Return by how much a lid would leave its travel, "" if it does not."""
    low, high = sorted(_lid_ends(rig, joint))
    beyond = np.maximum(low - angles_deg, angles_deg - high)
    worst = int(beyond.argmax())
    if beyond[worst] < TOLERANCE_DEG:
        return ""
    return (
        f"{joint} stops at its shut or open angle: {beyond[worst]:.1f} deg less "
        f"(at {times_s[worst]:.2f} s)"
    )


def _rest_deg(rig: Rig, joint: str) -> float:
    """Return the angle of a joint in the neutral pose."""
    return _lid_ends(rig, joint)[1] if joint in LIDS else 0.0


def _channel_value(rig: Rig, joint: str, angle: float, first: float, owned: bool) -> float:
    """Return an angle in the unit of the joint's channel: degrees; a lid's factor of its opening.

    Args:
        rig: the rig.
        joint: the joint.
        angle: its angle in degrees.
        first: its first angle, which is its rest if the track does not own it.
        owned: whether the track owns it.
    """
    if joint not in LIDS:
        return angle if owned else angle - first
    shut, wide = _lid_ends(rig, joint)
    base = wide if owned else first
    if (base - shut) / (wide - shut) < 0.2:
        raise SetupError(f"{joint}: it begins nearly shut; begin with open lids")
    return min(max((angle - shut) / (base - shut), 0.0), 3.0)


def _move_s(rig: Rig, joint: str, size_deg: float) -> float:
    """Return the shortest time in which tracks may move a joint of the rig so far."""
    known = [name for name in rig.names if channel_of_joint(name) == channel_of_joint(joint)]
    return float(shortest_move_s(radians(abs(size_deg)), rig.joints[known[0]].limit()))


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

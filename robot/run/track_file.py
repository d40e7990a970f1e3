"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings and from animation programs.
"""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.save import format_value
from gazerig.config.tracks import load_track, track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.track.track import EYE_CHANNELS, HEAD_CHANNELS, LID_CHANNELS
from gazerig.gaze.types import Floats
from gazerig.robot.model.reply import TrackReply
from gazerig.robot.model.track_fit import TrackRefused, channel_of_joint
from gazerig.robot.run.key_fit import GRID_S, fit_keys
from gazerig.robot.run.rig_limits import limits, track_fit

TOLERANCE_DEG = 0.7
"""Largest distance of the curve through fitted keys from the samples."""
_DENSE_S = 0.09
"""Rows closer than this are samples of a motion, not keys of an animator."""
_STILL_DEG = 0.01
_NEARLY_SHUT = 0.2

Series = tuple[Floats, Floats]
"""Times in seconds and angles in degrees of one joint."""


def write_track(
    rig: Rig,
    path: Path,
    series: Mapping[str, Series],
    description: str,
    *,
    force: bool = False,
    tolerance_deg: float = TOLERANCE_DEG,
    owned: bool = False,
) -> TrackReply:
    """Write joint angles over time as the file of a track, and check it against the rig.

    Args:
        rig: The rig whose joints it moves.
        path: Path of the file, whose name is that of the track.
        series: Times in seconds and angles in degrees, by joint of the rig.
        description: Meaning of the track.
        force: Whether a present file is replaced.
        tolerance_deg: Largest distance of the curve from dense samples.
        owned: Whether the track owns its joints and gives their angles; otherwise it is the
            motion relative to the first angle, over gaze.

    Returns:
        How the rig plays the track.

    Raises:
        SetupError: Nothing moves, the file cannot be written, or the rig cannot play the track.
        gazerig.config.load.ConfigError: The name or the track breaks a rule.
    """
    name = track_name(str(path))
    start_s = min(float(times[0]) for times, _ in series.values())
    frames: dict[int, dict[str, float]] = defaultdict(dict)
    for channel, samples in _channels(series, owned).items():
        times, angles = _keys(*samples, tolerance_deg)
        slots = np.rint((times - start_s) / GRID_S).astype(int).tolist()
        values = _values(rig, channel, angles, owned)
        for slot, value in zip(slots, values, strict=True):
            # An owned pose begins with a key, to which the player leads it from rest.
            if slot > 0 or owned:
                frames[slot + owned][channel] = round(float(value), 3)
    if len(frames) <= owned:
        raise SetupError(f"nothing moves by more than {tolerance_deg:g} deg")
    lines = [f"description: {format_value(description)}"]
    if owned:
        lines.append(f"owns: [{', '.join(one for one in rig.names if one in series)}]")
    lines += ["frames:", *(f"  - {_frame_text(slot, frames[slot])}" for slot in sorted(frames))]
    write_file(path, "\n".join(lines) + "\n", force)
    try:
        motion = track_fit(rig).motion(load_track(path), limits(rig.joints))
    except TrackRefused as refused:
        raise SetupError(f"{path} is written, but {rig.name} cannot play it: {refused}") from None
    return TrackReply(name, motion.duration_s, motion.limited)


def _channels(series: Mapping[str, Series], owned: bool) -> dict[str, Series]:
    """Return the series of each channel: the mean of both eyes.

    Over gaze, the eyes are lines of sight, which turn with the head.
    """
    found: dict[str, Series] = {}
    for name, pair in series.items():
        channel = channel_of_joint(name)
        found[channel] = _add(found[channel], pair, 0.5) if channel in found else pair
    for head, eye in zip(HEAD_CHANNELS, EYE_CHANNELS, strict=False):
        if not owned and head in found and eye in found:
            found[eye] = _add(found[eye], found[head], 1.0)
    return found


def _add(first: Series, second: Series, share: float) -> Series:
    both_s = np.union1d(first[0], second[0])
    return both_s, share * (np.interp(both_s, *first) + np.interp(both_s, *second))


def _keys(times_s: Floats, angles_deg: Floats, tolerance_deg: float) -> Series:
    """Return the keys of a series; the first alone if it rests."""
    least_deg = _STILL_DEG
    if len(times_s) > 4 and np.median(np.diff(times_s)) < _DENSE_S:
        times_s, angles_deg = fit_keys(times_s, angles_deg, tolerance_deg)
        least_deg = tolerance_deg
    moves = np.abs(angles_deg - angles_deg[0]).max() > least_deg
    return (times_s, angles_deg) if moves else (times_s[:1], angles_deg[:1])


def _values(rig: Rig, channel: str, angles_deg: Floats, owned: bool) -> Floats:
    """Return angles in the unit of a channel: degrees; a lid's factor of its opening.

    Their rest is the first one if the track does not own the channel.
    """
    if channel not in LID_CHANNELS:
        return angles_deg if owned else angles_deg - angles_deg[0]
    ends = rig.lid_joints.ends_deg(channel)
    if ends is None:
        raise SetupError(f"{channel}: the rig does not define its shut and open angles")
    shut, wide = ends
    base = wide if owned else angles_deg[0]
    if (base - shut) / (wide - shut) < _NEARLY_SHUT:
        raise SetupError(f"{channel}: it begins nearly shut; begin with open lids")
    return np.clip((angles_deg - shut) / (base - shut), 0.0, 3.0)


def _frame_text(slot: int, values: Mapping[str, float]) -> str:
    frame: dict[str, Any] = {"time_s": round(slot * GRID_S, 3)}
    for name, value in values.items():
        if name in (*HEAD_CHANNELS, *EYE_CHANNELS):
            frame[f"{name}_deg"] = value
        else:
            frame.setdefault("lids" if name in LID_CHANNELS else "joints_deg", {})[name] = value
    return format_value(frame)

"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings and from animation programs.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.save import format_value
from gazerig.config.tracks import check_name, load_track
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.track.motion import Curves, key_states
from gazerig.gaze.track.track import EYE_CHANNELS, HEAD_CHANNELS, LID_CHANNELS, TrackState
from gazerig.gaze.types import Floats
from gazerig.robot.loop.tracks import channel_of_joint
from gazerig.robot.model.commands import Play
from gazerig.robot.run.rig_limits import limits, track_fit

TOLERANCE_DEG = 0.7
"""Largest distance of the curve through fitted keys from the samples."""
GRID_S = 0.02
"""Grid of the keys' times."""
_SMOOTHING = np.linalg.pinv(np.vander(np.arange(-4, 5), 4))[-1]
"""Local cubic over 9 samples (Savitzky and Golay 1964), which removes the jitter of a hand and of
encoders; it keeps peaks that a mean would flatten."""
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
) -> TrackState:
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
        SetupError: Nothing moves, or the file cannot be written.
        gazerig.config.load.ConfigError: The name or the track breaks a rule.
    """
    check_name(path)
    start_s = min(times[0] for times, _ in series.values())
    frames: dict[float, dict[str, Any]] = {}
    for channel, times, angles in _keys(series, owned, tolerance_deg):
        values = _values(rig, channel, angles, owned).round(3).tolist()
        for time_s, value in zip(times.tolist(), values, strict=True):
            time_s = round(GRID_S * (round((time_s - start_s) / GRID_S) + owned), 3)
            if time_s == 0.0:
                continue  # it begins at rest; only an owned pose begins with a key
            frame = frames.setdefault(time_s, {"time_s": time_s})
            if channel in HEAD_CHANNELS or channel in EYE_CHANNELS:
                frame[f"{channel}_deg"] = value
            else:
                group = "lids" if channel in LID_CHANNELS else "joints_deg"
                frame.setdefault(group, {})[channel] = value
    if len(frames) <= owned:
        raise SetupError(f"nothing moves by more than {tolerance_deg:g} deg")
    lines = [f"description: {format_value(description)}"]
    if owned:
        lines.append(f"owns: [{', '.join(series)}]")
    lines += ["frames:", *[f"  - {format_value(frames[at])}" for at in sorted(frames)]]
    write_file(path, "\n".join(lines) + "\n", force)
    motion = track_fit(rig).motion(load_track(path), limits(rig.joints), Play(path.stem))
    return motion.state


def _keys(
    series: Mapping[str, Series], owned: bool, tolerance_deg: float
) -> Iterator[tuple[str, Floats, Floats]]:
    """Yield the times and angles of the keys of each channel; the first key alone if it rests.

    Both eyes have their mean. Over gaze, they are lines of sight, which turn with the head.
    """
    members: dict[str, list[Series]] = defaultdict(list)
    for name, samples in series.items():
        members[channel_of_joint(name)].append(samples)
    heads = {} if owned else dict(zip(EYE_CHANNELS, HEAD_CHANNELS, strict=False))
    for channel, pairs in members.items():
        head = members.get(heads.get(channel, ""), [])
        times_s = np.unique(np.concatenate([times for times, _ in (*pairs, *head)]))
        eyes = np.mean([np.interp(times_s, *pair) for pair in pairs], axis=0)
        angles_deg, still_deg = sum([np.interp(times_s, *one) for one in head], eyes), _STILL_DEG
        if len(times_s) > 4 and np.median(np.diff(times_s)) < _DENSE_S:
            times_s, angles_deg = fit_keys(times_s, angles_deg, tolerance_deg)
            still_deg = tolerance_deg
        count = None if np.ptp(angles_deg) > still_deg else 1
        yield channel, times_s[:count], angles_deg[:count]


def fit_keys(times_s: Floats, values: Floats, tolerance: float) -> Series:
    """Return keys whose curve stays within a tolerance of smoothed samples.

    Each segment that deviates too much gets another key at its worst place, until none does.

    Args:
        times_s: (n,) Increasing times of the samples.
        values: (n,) Values; the motion rests at both ends.
        tolerance: Largest distance of the curve from the smoothed samples.
    """
    even_s = np.arange(times_s[0], times_s[-1] + 1e-9, GRID_S)
    even = np.interp(even_s, times_s, values)
    smooth = np.convolve(np.pad(even, len(_SMOOTHING) // 2, mode="edge"), _SMOOTHING, "valid")
    keys = [0, len(smooth) - 1]
    while True:
        curve = Curves(even_s[keys], key_states(even_s[keys], smooth[keys])[:, :, None])
        error = np.abs(curve.sample(even_s)[0, :, 0] - smooth)
        worst = [a + int(error[a:b].argmax()) for a, b in pairwise(keys)]
        more = [i for i in worst if error[i] > tolerance]
        if not more:
            return even_s[keys], smooth[keys]
        keys = sorted({*keys, *more})


def _values(rig: Rig, channel: str, angles_deg: Floats, owned: bool) -> Floats:
    """Return angles in the unit of a channel: degrees; a lid's factor of its opening.

    Their rest is the first one if the track does not own the channel.
    """
    if channel not in LID_CHANNELS:
        return angles_deg if owned else angles_deg - angles_deg[0]
    ends = rig.lid_joints.ends_deg(channel)
    assert ends is not None  # a rule of the rig
    openings = (angles_deg - ends[0]) / (ends[1] - ends[0])
    rest = 1.0 if owned else openings[0]
    if rest < _NEARLY_SHUT:
        raise SetupError(f"{channel}: it begins nearly shut; begin with open lids")
    return np.clip(openings / rest, 0.0, 3.0)

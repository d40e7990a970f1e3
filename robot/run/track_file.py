"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings and from animation programs.
"""

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gazerig.config.load import ConfigError
from gazerig.config.rig import Rig
from gazerig.config.save import format_value
from gazerig.config.shipped_files import is_path
from gazerig.config.tracks import load_track, track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.track.motion_keys import GRID_S, fit_keys, resample, smooth
from gazerig.gaze.track.track import EYE_CHANNELS, HEAD_CHANNELS, LID_CHANNELS, Track
from gazerig.gaze.types import Floats
from gazerig.robot.model.reply import TrackReply
from gazerig.robot.model.track_fit import TrackFit, TrackRefused, channel_of_joint
from gazerig.robot.run.rig_limits import face_tables, lid_spans, limits

TOLERANCE_DEG = 0.7
"""Largest distance of the curve through fitted keys from the samples."""
_DENSE_S = 0.09
"""Rows closer than this are samples of a motion, not keys of an animator."""
_STILL_DEG = 0.01

Series = tuple[Floats, Floats]
"""Times in seconds and angles in degrees of one joint."""


class TrackFolder:
    """Tracks in the folder beside a rig, which are found as soon as they are written.

    Args:
        rig: Name or path of the rig; one without a file has no folder.
    """

    def __init__(self, rig: str) -> None:
        self._folder = Path(rig).expanduser().parent / "tracks" if is_path(rig) else None
        self._stamps = self._read_stamps()

    def changes(self) -> dict[str, Track | str]:
        """Return the tracks whose files are new or changed since the last call; or their fault."""
        before, self._stamps = self._stamps, self._read_stamps()
        found: dict[str, Track | str] = {}
        for path, stamp in self._stamps.items():
            if before.get(path) != stamp:
                try:
                    found[track_name(str(path))] = load_track(path)
                except ConfigError as error:
                    found[path.stem] = str(error)
        return found

    def _read_stamps(self) -> dict[Path, tuple[int, int]]:
        """Return time and size of each file."""
        found = {}
        for path in self._folder.glob("*.yaml") if self._folder is not None else ():
            with contextlib.suppress(OSError):  # it has just been removed
                status = path.stat()
                found[path] = status.st_mtime_ns, status.st_size
        return found


def write_track(
    rig: Rig,
    path: Path,
    series: Mapping[str, Series],
    description: str,
    *,
    force: bool = False,
    tolerance_deg: float | None = None,
    owned: bool = False,
) -> TrackReply:
    """Write joint angles over time as the file of a track, and check it against the rig.

    Args:
        rig: The rig whose joints it moves.
        path: Path of the file, whose name is that of the track.
        series: Times in seconds and angles in degrees, by joint of the rig.
        description: Meaning of the track.
        force: Whether a present file is replaced.
        tolerance_deg: Distance of the curve from dense samples; None: samples of a hand, whose
            jitter is smoothed first.
        owned: Whether the track owns its joints and gives their angles; otherwise it is the
            motion relative to the first angle, over gaze.

    Returns:
        How the rig plays the track.

    Raises:
        SetupError: Nothing moves, the file cannot be written, or the rig cannot play the track.
        gazerig.config.load.ConfigError: The name or the track breaks a rule.
    """
    name = track_name(str(path))
    frames = _frames(rig, series, tolerance_deg, owned)
    lines = [f"description: {format_value(description)}"]
    if owned:
        lines.append(f"owns: [{', '.join(one for one in rig.names if one in series)}]")
    lines += ["frames:", *(f"  - {_frame_text(t, frames[t])}" for t in sorted(frames))]
    write_file(path, "\n".join(lines) + "\n", force)
    try:
        return fit_to_rig(rig, name, load_track(path))
    except TrackRefused as refused:
        raise SetupError(f"{path} is written, but {rig.name} cannot play it: {refused}") from None


def fit_to_rig(rig: Rig, name: str, track: Track) -> TrackReply:
    """Return how a rig plays a track.

    Raises:
        TrackRefused: it cannot.
    """
    fit = TrackFit(rig.names, lid_spans(rig), face_tables(rig))
    return fit.motion(name, track, limits(rig.joints))[1]


def _frames(
    rig: Rig, series: Mapping[str, Series], tolerance_deg: float | None, owned: bool
) -> dict[float, dict[str, float]]:
    """Return the values of the channels by time."""
    start_s = min(float(times[0]) for times, _ in series.values())
    frames: dict[float, dict[str, float]] = {}
    moves = False
    for channel, (times, angles) in _channels(series, owned).items():
        keys = _keys(times - start_s, angles, tolerance_deg)
        moves |= bool(keys)
        if owned:  # its first pose is a key too, to which the player leads it from rest
            keys = [(GRID_S, float(angles[0])), *((at_s + GRID_S, value) for at_s, value in keys)]
        for at_s, angle in keys:
            value = _value(rig, channel, angle, float(angles[0]), owned)
            frames.setdefault(round(at_s, 3), {})[channel] = round(value, 3)
    if not moves:
        raise SetupError(f"nothing moves by more than {tolerance_deg or TOLERANCE_DEG:g} deg")
    return frames


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


def _keys(
    times_s: Floats, angles_deg: Floats, tolerance_deg: float | None
) -> list[tuple[float, float]]:
    """Return the keys of a series after time 0, on the grid of times; none if it rests."""
    if np.abs(angles_deg - angles_deg[0]).max() <= _STILL_DEG:
        return []
    times, values = times_s, angles_deg
    if len(times) > 4 and float(np.median(np.diff(times))) < _DENSE_S:
        samples = (smooth if tolerance_deg is None else resample)(times, values)
        times, values = fit_keys(*samples, tolerance_deg or TOLERANCE_DEG)
        times = times + float(times_s[0])
    pairs = {round(float(t) / GRID_S): float(v) for t, v in zip(times, values, strict=True)}
    return [(round(k * GRID_S, 3), v) for k, v in pairs.items() if k > 0]


def _value(rig: Rig, channel: str, angle: float, first: float, owned: bool) -> float:
    """Return an angle in the unit of a channel: degrees; a lid's factor of its opening.

    Args:
        rig: The rig.
        channel: The channel.
        angle: Its angle in degrees.
        first: Its first angle, which is its rest if the track does not own it.
        owned: Whether the track owns it.
    """
    if channel not in LID_CHANNELS:
        return angle if owned else angle - first
    ends = rig.lid_joints.ends_deg(channel)
    if ends is None:
        raise SetupError(f"{channel}: the rig does not define its shut and open angles")
    shut, wide = ends
    base = wide if owned else first
    if (base - shut) / (wide - shut) < 0.2:
        raise SetupError(f"{channel}: it begins nearly shut; begin with open lids")
    return min(max((angle - shut) / (base - shut), 0.0), 3.0)


def _frame_text(time_s: float, values: Mapping[str, float]) -> str:
    frame: dict[str, Any] = {"time_s": time_s}
    for name, value in values.items():
        if name in (*HEAD_CHANNELS, *EYE_CHANNELS):
            frame[f"{name}_deg"] = value
        else:
            frame.setdefault("lids" if name in LID_CHANNELS else "joints_deg", {})[name] = value
    return format_value(frame)

"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings and from animation programs.
"""

import contextlib
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gazerig.config.load import ConfigError, load
from gazerig.config.rig import Rig
from gazerig.config.save_text import format_value, params_text
from gazerig.config.shipped_files import is_path
from gazerig.config.tracks import load_track, track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.gaze.track.motion_keys import GRID_S, fit_keys, resample, smooth
from gazerig.gaze.track.track import (
    EYE_CHANNELS,
    HEAD_CHANNELS,
    LID_CHANNELS,
    MAX_DURATION_S,
    MAX_FRAMES,
    Track,
)
from gazerig.gaze.types import Floats
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.reply import TrackReply
from gazerig.robot.model.track_fit import TrackFit, TrackRefused, channel_of_joint
from gazerig.robot.model.types import GAZE_JOINTS
from gazerig.robot.run.rig_limits import animation_tables, lid_spans, limits

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

    def to_text(self, track: Track) -> str:
        """Return a track as YAML, with the name of its sound."""
        return params_text(replace(track, sound=Path(track.sound).name))

    def from_text(self, text: str) -> Track:
        """Return the track of a YAML text, which a recording holds."""
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            return load(Path(file.name), Track)

    def _read_stamps(self) -> dict[Path, tuple[int, int]]:
        """Return time and size of each file."""
        found = {}
        for path in self._folder.glob("*.yaml") if self._folder is not None else ():
            with contextlib.suppress(OSError):  # it has just been removed
                status = path.stat()
                found[path] = status.st_mtime_ns, status.st_size
        return found


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
    length_s = max(float(times[-1]) for times, _ in series.values()) - start_s
    if not GRID_S < length_s <= MAX_DURATION_S:
        raise SetupError(
            f"it takes {length_s:.6g} s: a track takes at most {MAX_DURATION_S:g} s; split it"
        )
    means, notes = _average_eyes(series)
    if not owned:
        means = _lines_of_sight(means)
    frames: dict[float, dict[str, float]] = {}
    moves = False
    for name, (times, angles) in means.items():
        keys = _joint_keys(name, times - start_s, angles, tolerance_deg)
        moves |= bool(keys)
        if owned:  # its first pose is a key too, to which the player leads it from rest
            keys = [(GRID_S, float(angles[0])), *((at_s + GRID_S, value) for at_s, value in keys)]
        for at_s, value in keys:
            most = 90.0 if name in GAZE_JOINTS else 180.0
            value = _channel_value(rig, name, value, float(angles[0]), owned)
            if abs(value) > most:
                raise SetupError(
                    f"{name} at {at_s + start_s:.2f} s: {value:.4g} deg, more than the {most:g} "
                    "deg of any joint: check the unit of the angles"
                )
            frame = frames.setdefault(round(at_s, 3), {})
            frame[channel_of_joint(name)] = round(value, 3)
        if keys and name in LIDS:
            notes += _lid_notes(rig, name, times, angles)
    if not moves:
        raise SetupError(f"nothing moves by more than {tolerance_deg or TOLERANCE_DEG:g} deg")
    if len(frames) > MAX_FRAMES:
        raise SetupError(
            f"{len(frames):,} frames; a track has at most {MAX_FRAMES:,}: import it with a larger "
            "--tolerance, or in parts"
        )
    owns = ", ".join(name for name in rig.names if name in series)
    lines = [f"description: {format_value(description)}"]
    lines += [f"owns: [{owns}]"] if owned else []
    lines += ["frames:"]
    lines += [f"  - {_frame_text(t, frames[t])}" for t in sorted(frames)]
    return TrackText("\n".join(lines) + "\n", notes)


def write_track(
    rig: Rig, name: str, text: str, folder: Path, force: bool
) -> tuple[Path, TrackReply]:
    """Write a track's file and check it against the rig.

    Returns:
        The file, and how the rig plays it.

    Raises:
        SetupError: the file cannot be written, or the rig cannot play the track.
        gazerig.config.load.ConfigError: the name or the track breaks a rule.
    """
    path = folder / f"{name}.yaml"
    track_name(str(path))
    write_file(path, text, force)
    try:
        return path, fit_to_rig(rig, name, load_track(path))
    except TrackRefused as refused:
        raise SetupError(f"{path} is written, but {rig.name} cannot play it: {refused}") from None


def fit_to_rig(rig: Rig, name: str, track: Track) -> TrackReply:
    """Return how a rig plays a track from the middle of its ranges.

    Raises:
        TrackRefused: it cannot.
    """
    bounds = limits(rig.joints)
    middle = np.clip(0.0, [one.low_rad for one in bounds], [one.high_rad for one in bounds])
    fit = TrackFit(rig.names, lid_spans(rig), animation_tables(rig))
    placed = fit.place(track)
    _, reduced = fit.sizes(placed, middle, bounds)
    return fit.reply(name, placed, fit.motion(placed, bounds), reduced)


def radians_hint(angles_deg: Iterable[float], below: float = 1.0) -> str:
    """Return a hint if all angles are so small that they may be in radians, otherwise "".

    It is no fault: a sway, or a mechanism with tiny motion, may have such angles in degrees.

    Args:
        angles_deg: The angles.
        below: Size that one of them must have.
    """
    largest = max(map(abs, angles_deg), default=0.0)
    if not 0.0 < largest < below:
        return ""
    return f"no angle is above {largest:.3g}: degrees? these look like radians (1 rad is 57.3 deg)"


def track_angles_deg(track: Track) -> Iterator[float]:
    """Yield the angles of a track's frames."""
    for frame in (*track.frames, *track.frames_without_neck):
        for channel, value in frame.values().items():
            if channel not in LID_CHANNELS:
                yield degrees(value)


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


def _lines_of_sight(series: Mapping[str, Series]) -> dict[str, Series]:
    """Return the series with eyes as they turn in space, as tracks over gaze move them."""
    heads = {channel_of_joint(name): pair for name, pair in series.items()}
    found = dict(series)
    for name, (times, angles) in series.items():
        head = heads.get(channel_of_joint(name).replace("eyes", "head"))
        if channel_of_joint(name) in EYE_CHANNELS and head is not None:
            both_s = np.union1d(times, head[0])
            found[name] = both_s, np.interp(both_s, times, angles) + np.interp(both_s, *head)
    return found


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


def _lid_notes(rig: Rig, joint: str, times_s: Floats, angles_deg: Floats) -> tuple[str, ...]:
    """Return by how much a lid would leave its travel, () if it does not."""
    low, high = sorted(_lid_ends(rig, joint))
    beyond = np.maximum(low - angles_deg, angles_deg - high)
    worst = int(beyond.argmax())
    if beyond[worst] < TOLERANCE_DEG:
        return ()
    return (
        f"{joint} stops at its shut or open angle: {beyond[worst]:.1f} deg less "
        f"(at {times_s[worst]:.2f} s)",
    )


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


def _frame_text(time_s: float, values: Mapping[str, float]) -> str:
    frame: dict[str, Any] = {"time_s": time_s}
    for name, value in values.items():
        if name in (*HEAD_CHANNELS, *EYE_CHANNELS):
            frame[f"{name}_deg"] = value
        else:
            frame.setdefault("lids" if name in LIDS else "joints_deg", {})[name] = value
    return format_value(frame)

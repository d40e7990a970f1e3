"""Conversion of joint angles over time to a track's YAML file, which the rig's loader reads.

Such angles come from recordings, or from CSV tables of animation programs, one row per frame or
key. Wide: a column of times and one of angles for each joint. Long: columns time, joint, angle, one
row for each key. Times are in seconds (time, time_s) or numbers of frames (frame), angles in
degrees. Separators are commas, semicolons or tabs.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.save_text import format_value
from gazerig.config.tracks import load_track, track_name
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
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


def track_text(rig: Rig, series: Mapping[str, Series], description: str) -> str:
    """Return a track as YAML.

    Args:
        rig: the rig whose joints it moves.
        series: times in seconds and angles in degrees, by joint of the rig; the track is the
            motion relative to the first angle.
        description: meaning of the track.

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
    for name, (times, angles) in series.items():
        for time_s, value in _joint_keys(rig, name, times, angles, start_s):
            keys.setdefault(_channel_of_joint(name), []).append((time_s, value))
    keys = {channel: _average_keys(found) for channel, found in keys.items() if found}
    if not keys:
        raise SetupError(f"nothing moves; movements below {TOLERANCE_DEG:g} deg count as jitter")
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


def _joint_keys(
    rig: Rig, joint: str, times_s: Floats, angles_deg: Floats, start_s: float
) -> list[tuple[float, float]]:
    """Return the keys of one joint; for a lid, factors of its first opening."""
    dense = len(times_s) > 4 and float(np.median(np.diff(times_s))) < _DENSE_S
    values = angles_deg - angles_deg[0]
    if np.abs(values).max() <= _STILL_DEG:
        return []
    if dense:
        times, values = fit_keys(*smooth(times_s, values), TOLERANCE_DEG)
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


def _average_keys(keys: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return keys in the order of their times; two joints of one channel are averaged."""
    at: dict[float, list[float]] = {}
    for time_s, value in sorted(keys):
        at.setdefault(time_s, []).append(value)
    return [(time_s, round(sum(them) / len(them), 3)) for time_s, them in at.items()]


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


_TIMES = ("time", "time_s", "t", "seconds", "frame")
_JOINTS = ("joint", "bone", "effector", "servo", "motor", "name")
_ANGLES = ("angle", "angle_deg", "value", "degrees", "deg")
_LARGEST = 5_000_000
_MOST_FAULTS = 10


def read_table(path: Path, fps: float | None) -> dict[str, Series]:
    """Return the keys of every joint of a CSV file.

    Args:
        path: Path of the file.
        fps: frames per second, for a column of frame numbers.

    Raises:
        SetupError: the file cannot be read or has bad rows, each with its line.
    """
    try:
        text = read_limited(path, _LARGEST).decode("utf-8-sig")
    except OSError as error:
        raise SetupError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SetupError(f"{path} is not UTF-8 text: export it as CSV") from None
    separator = max(",;\t", key=text.partition("\n")[0].count)
    rows = list(csv.reader(text.splitlines(), delimiter=separator))
    head = [name.strip().lower() for name in rows[0]] if rows else []
    time = next((i for i, name in enumerate(head) if name in _TIMES), None)
    if time is None:
        raise SetupError(
            f"{path}:1: no column of times: the first row must name the columns, one of them "
            f"{', '.join(_TIMES)}"
        )
    if head[time] == "frame" and fps is None:
        raise SetupError(f"{path}:1: times are frame numbers: give --fps, e.g. 24 or 30")
    table = _Table(path, head, time, 1.0 / fps if head[time] == "frame" and fps else 1.0)
    found = table.read_keys(rows)
    if table.faults:
        more = len(table.faults) - _MOST_FAULTS
        shown = table.faults[:_MOST_FAULTS] + ([f"and {more} more"] if more > 0 else [])
        raise SetupError("\n".join(shown))
    if not found:
        raise SetupError(f"{path}: no rows below the column names")
    return found


class _Table:
    """Rows of one file; faults: the invalid lines with their errors."""

    def __init__(self, path: Path, head: Sequence[str], time: int, unit_s: float) -> None:
        self.faults: list[str] = []
        self._path, self._head, self._time, self._unit_s = path, head, time, unit_s
        self._joint = next((i for i, name in enumerate(head) if name in _JOINTS), None)
        self._angle = next((i for i, name in enumerate(head) if name in _ANGLES), None)

    def read_keys(self, rows: Sequence[Sequence[str]]) -> dict[str, Series]:
        """Return the keys by joint, in the order of their times."""
        found: dict[str, dict[float, float]] = {}
        last_s: dict[str, float] = {}
        for line, row in enumerate(rows[1:], start=2):
            if not any(cell.strip() for cell in row):
                continue
            for joint, time_s, angle in self._row_keys(line, row):
                if time_s <= last_s.get(joint, -1.0):
                    self._add_error(line, f"{joint}: {time_s:g} s is not after {last_s[joint]:g} s")
                last_s[joint] = time_s
                found.setdefault(joint, {})[time_s] = angle
        return {
            name: (np.array(list(keys)), np.array(list(keys.values())))
            for name, keys in found.items()
        }

    def _row_keys(self, line: int, row: Sequence[str]) -> Iterator[tuple[str, float, float]]:
        """Yield the keys of one row; an empty cell of a wide table is not a key."""
        if len(row) != len(self._head):
            self._add_error(
                line, f"has {len(row)} columns, but the first row has {len(self._head)}"
            )
            return
        time = self._read_number(line, self._head[self._time], row[self._time])
        if time is None:
            return
        if time < 0.0:
            self._add_error(line, f"{self._head[self._time]} {time:g} is before 0")
            return
        if self._joint is not None and self._angle is not None:
            pairs = [(row[self._joint].strip(), row[self._angle])]
        else:
            pairs = [
                (n, row[i]) for i, n in enumerate(self._head) if i != self._time and row[i].strip()
            ]
        for joint, cell in pairs:
            angle = self._read_number(line, joint, cell)
            if angle is not None:
                yield joint, time * self._unit_s, angle

    def _read_number(self, line: int, what: str, cell: str) -> float | None:
        try:
            value = float(cell)
        except ValueError:
            value = float("nan")
        if isfinite(value):
            return value
        self._add_error(line, f"{what}: {cell.strip()!r:.40} is not a number")
        return None

    def _add_error(self, line: int, text: str) -> None:
        self.faults.append(f"{self._path}:{line}: {text}")

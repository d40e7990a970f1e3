"""Export of a run as CSV for eye-tracking tools and spreadsheets: samples and events.

Angles are those of lines of sight in space, not in the head:

x  yaw, the rotation about the vertical axis of the world, + to the robot's own left
y  pitch above the horizontal, + up

0, 0 is horizontal and straight ahead of the base. ``x_deg`` and ``y_deg`` are the cyclopean gaze,
the mean of both eyes' unit lines of sight. These are Fick angles: a rotation in x of 1 deg moves
the gaze by cos(y) deg. Lids are 0 shut .. 1 open. A cell is empty in a tick in which its servo did
not answer, and in all ticks if the rig lacks the joint.

Movements are not detected: the models report theirs in every tick. The servos follow the plan with
a lag, so the labels are shifted by the lag at which planned and measured gaze fit best. Amplitudes
and speeds are measured. ``target`` is the chosen target, at which the eyes arrive after a saccade.
"""

import csv
from codecs import getwriter
from collections.abc import Iterator, Sequence
from itertools import groupby
from math import degrees, isfinite, nan
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import output_file
from gazerig.gaze.angles import angle_between, sub, unit, yaw_pitch
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Floats, Vec3, body_name
from gazerig.robot.loop.tick import Tick, cyclopean_direction

_JOINTS = {
    "neck_yaw": "head_yaw_deg", "neck_pitch": "head_pitch_deg", "neck_roll": "head_roll_deg",
    "left_upper_lid": "left_lid", "right_upper_lid": "right_lid",
    "left_lower_lid": "left_lower_lid", "right_lower_lid": "right_lower_lid",
}  # fmt: skip
"""Joints with a column of their own."""
SAMPLES = (
    "time_s", "x_deg", "y_deg", "left_x_deg", "left_y_deg", "right_x_deg", "right_y_deg",
    *_JOINTS.values(), "event", "target", "part",
)  # fmt: skip
EVENTS = ("onset_s", "duration_s", "event", "amplitude_deg", "peak_deg_s", "target", "part")
_MOVEMENTS = {"fixate": "fixation", "saccade": "saccade", "pursue": "pursuit"}
_LONGEST_LAG = 20
"""Ticks, a tenth of a second at 200 Hz."""
_LOST = (nan, nan, nan)


class GazeExport:
    """Samples and events of a run, collected tick by tick.

    Attributes:
        estimated: Names of the joints whose servos have no feedback: estimated from commands.
    """

    def __init__(self) -> None:
        self._samples: list[tuple[float, ...]] = []
        self._gaze: list[Vec3] = []
        self._planned: list[Vec3] = []
        self._labels: list[tuple[str, str, str, str]] = []
        self.estimated: tuple[str, ...] = ()

    def update(self, tick: Tick) -> None:
        """Add a tick."""
        pose, target, missing = tick.pose, tick.target, tick.joints.missing
        lost_left, lost_right = (
            any(name.startswith(("neck_", "eyes_", f"{side}_eye_")) for name in missing)
            for side in ("left", "right")
        )
        gaze = _LOST if lost_left or lost_right else cyclopean_direction(tick)
        left = _LOST if lost_left else line_of_sight(pose, left=True)
        right = _LOST if lost_right else line_of_sight(pose, left=False)
        angles = (degrees(a) for way in (gaze, left, right) for a in yaw_pitch(way))
        lids = pose.lid_left, pose.lid_right, pose.lower_left, pose.lower_right
        joints = zip(_JOINTS, (*map(degrees, pose.head_rad), *lids), strict=True)
        known = {*tick.guard_result.joints}.difference(missing)
        own = (value if name in known else nan for name, value in joints)
        self._samples.append((tick.t_s, *angles, *own))
        self._gaze.append(gaze)
        self._planned.append(unit(sub(tick.gaze.gaze_point_world_m, pose.p_world_head_m)))
        movement = "" if tick.stopped else _MOVEMENTS[tick.gaze.phase]
        blink = "blink" if tick.gaze.blink and not tick.stopped else ""
        name = body_name(target.kind, target.id)
        self._labels.append((movement, blink, name, target.part or ""))
        self.estimated = tick.estimated_joints

    def write(self, stem: Path, force: bool = False) -> str:
        """Write STEM_samples.csv and STEM_events.csv; return a summary.

        Args:
            stem: Path and first part of the file names.
            force: Replace existing files.

        Raises:
            SetupError: A file exists or cannot be written, or there are fewer than two ticks.
        """
        if len(self._samples) < 2:
            raise SetupError("fewer than two ticks: there is nothing to export")
        times = np.array([sample[0] for sample in self._samples])
        times -= times[0]
        speed = _speed_deg_s(times, self._gaze)
        lag = _lag(_speed_deg_s(times, self._planned), speed)
        labels = [self._labels[max(0, k - lag)] for k in range(len(times))]
        events = sorted(self._events(times.tolist(), speed, labels), key=lambda event: event[0])
        samples = (
            (t, *sample[1:], blink or movement, *target)
            for t, sample, (movement, blink, *target) in zip(
                times.tolist(), self._samples, labels, strict=True
            )
        )
        for path, names, rows in zip(
            csv_files(stem), (SAMPLES, EVENTS), (samples, events), strict=True
        ):
            with output_file(path, force) as file:
                writer = csv.writer(getwriter("utf-8")(file), lineterminator="\n")
                writer.writerow(names)
                writer.writerows(map(_cell, row) for row in rows)
        return (
            f"{len(times)} samples, {len(events)} events; labels are the plan's, "
            f"{1e3 * times[lag]:.0f} ms later, as the eyes follow it"
        )

    def _events(
        self, times: list[float], speed: Floats, labels: list[tuple[str, str, str, str]]
    ) -> Iterator[tuple[float, float, str, float, float, str, str]]:
        """Yield movements, then blinks, which overlap them."""
        for kind in (0, 1):
            start = 0
            for event, ticks in groupby(label[kind] for label in labels):
                end = start + len([*ticks])
                if event:
                    amplitude = degrees(angle_between(self._gaze[start], self._gaze[end - 1]))
                    moved = (nan, nan) if kind else (amplitude, float(np.max(speed[start:end])))
                    lasts_s = times[min(end, len(times) - 1)] - times[start]
                    yield times[start], lasts_s, event, *moved, *labels[start][2:]
                start = end


def csv_files(stem: Path) -> tuple[Path, ...]:
    """Return the files that ``GazeExport.write`` writes."""
    return tuple(stem.with_name(f"{stem.name}_{kind}.csv") for kind in ("samples", "events"))


def _cell(value: object) -> object:
    """Format a number in units of 1e-6, and as "" if it is lost."""
    return (f"{value:.6f}" if isfinite(value) else "") if isinstance(value, float) else value


def _speed_deg_s(times: Floats, ways: Sequence[Vec3]) -> Floats:
    """Return the angular speed (n,) of unit directions, each over two sample intervals."""
    rates = np.gradient(np.array(ways), times, axis=0)
    speed: Floats = np.degrees(np.linalg.norm(rates, axis=1))
    return speed


def _lag(planned: Floats, seen: Floats) -> int:
    """Return by how many ticks the measured gaze follows the planned one: best fit of speeds.

    Speeds are compared because the gaze may have a constant offset; saccades decide.
    """
    seen = np.nan_to_num(seen)
    lags = range(min(len(seen), _LONGEST_LAG))
    return int(np.argmax([planned[: len(seen) - lag] @ seen[lag:] for lag in lags]))

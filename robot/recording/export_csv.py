"""Export of a run as CSV for eye-tracking tools and spreadsheets: samples, events, fixations.

Angles and signs are those of gazerig.robot.recording.gaze_angles. An empty cell is a lost eye.
"""

import csv
from codecs import getwriter
from collections.abc import Collection, Iterable, Iterator, Sequence
from math import isfinite
from pathlib import Path

from gazerig.drivers.files.file_output import output_file, refuse_existing
from gazerig.robot.recording.gaze_angles import (
    LID_JOINTS,
    MOVEMENTS,
    NECK_AXES,
    GazeAngles,
    LabelledInterval,
    Labels,
)

_GAZE = (
    "time_s", "x_deg", "y_deg", "left_x_deg", "left_y_deg", "right_x_deg", "right_y_deg",
)  # fmt: skip
_HEAD = ("head_yaw_deg", "head_pitch_deg", "head_roll_deg")
_LIDS = ("left_lid", "right_lid", "left_lower_lid", "right_lower_lid")
_EVENTS = ("onset_s", "duration_s", "event", "amplitude_deg", "peak_deg_s", "target", "part")
_FIXATIONS = ("start_s", "duration_s", "part", "target")
"""Columns that `gazerig fit-scanpath` reads; a pursued part counts as a fixated one."""


def write_csv(
    trace: GazeAngles,
    labels: Labels,
    stretches: Sequence[LabelledInterval],
    stem: Path,
    force: bool = False,
) -> tuple[Path, ...]:
    """Write STEM_samples.csv, _events.csv and _fixations.csv; return their paths.

    Args:
        trace: Gaze angles of the run.
        labels: Labels of the samples.
        stretches: Labelled intervals in the order of their onsets.
        stem: Path and first part of the file names.
        force: Replace existing files.

    Raises:
        SetupError: A file exists or cannot be written.
    """
    paths = csv_files(stem)
    refuse_existing(*paths, force=force)
    events = (
        (s.onset_s, s.duration_s, s.event, s.amplitude_deg, s.peak_deg_s, *s.looked_at)
        for s in stretches
    )
    fixations = (
        (s.onset_s, s.duration_s, s.looked_at.part, s.looked_at.target)
        for s in _join_fixations(stretches)
    )
    tables: tuple[tuple[Sequence[str], Iterable[Sequence[object]]], ...] = (
        (columns(trace.joints), _sample_rows(trace, labels)),
        (_EVENTS, events),
        (_FIXATIONS, fixations),
    )
    for path, (names, rows) in zip(paths, tables, strict=True):
        with output_file(path, force) as file:
            writer = csv.writer(getwriter("utf-8")(file), lineterminator="\n")
            writer.writerow(names)
            writer.writerows(map(_cell, row) for row in rows)
    return paths


def csv_files(stem: Path) -> tuple[Path, ...]:
    """Return the files that ``write_csv`` writes."""
    return tuple(
        stem.with_name(f"{stem.name}_{kind}.csv") for kind in ("samples", "events", "fixations")
    )


def columns(joints: Collection[str]) -> tuple[str, ...]:
    """Return the columns of the samples of a rig with these joints.

    ``x_deg`` and ``y_deg`` are the cyclopean gaze. Lids are 0 shut .. 1 open. ``event`` is "blink"
    during a blink, otherwise the movement. ``target`` and ``part`` are the fixated object, and
    during a saccade its destination.
    """
    names = zip((*NECK_AXES, *LID_JOINTS), (*_HEAD, *_LIDS), strict=True)
    own = [column for joint, column in names if joint in joints]
    return (*_GAZE, *own, "event", "movement", "target", "part")


def _cell(value: object) -> object:
    """Format a number in units of 1e-6, and as "" if it is lost."""
    if value is None:
        return ""
    return (f"{value:.6f}" if isfinite(value) else "") if isinstance(value, float) else value


def _sample_rows(trace: GazeAngles, labels: Labels) -> Iterator[Sequence[object]]:
    head = [joint in trace.joints for joint in NECK_AXES]
    lid = [joint in trace.joints for joint in LID_JOINTS]
    rows = zip(
        trace.time_s.tolist(), trace.cyclopean_deg.tolist(), trace.left_deg.tolist(),
        trace.right_deg.tolist(), trace.head_deg[:, head].tolist(), trace.lids[:, lid].tolist(),
        labels.event(), labels.movement.tolist(), labels.looked_at.tolist(), strict=True,
    )  # fmt: skip
    for time_s, *groups, event, movement, looked_at in rows:
        values = (value for group in groups for value in group)
        yield time_s, *values, event, MOVEMENTS[movement], *trace.names[looked_at]


def _join_fixations(stretches: Iterable[LabelledInterval]) -> Iterator[LabelledInterval]:
    """Return the fixations, joined with pursuits of the same part up to a saccade."""
    stay: LabelledInterval | None = None
    for s in (s for s in stretches if s.event != "blink"):
        rests = s.event in ("fixation", "pursuit")
        if stay is not None and rests and s.looked_at == stay.looked_at:
            stay = stay._replace(duration_s=s.onset_s + s.duration_s - stay.onset_s)
            continue
        if stay is not None:
            yield stay
        stay = s if rests else None
    if stay is not None:
        yield stay

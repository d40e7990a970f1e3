"""Export of a run as CSV for eye-tracking tools and spreadsheets: samples, events, fixations.

Angles and signs are those of gazerig.robot.recording.gaze_angles. An empty cell is a lost eye.
A JSON file next to the samples lists which of them were measured and which were estimated.
"""

import csv
import json
from codecs import getwriter
from collections.abc import Collection, Iterable, Iterator, Sequence
from math import isfinite
from pathlib import Path

import numpy as np

from gazerig.drivers.files.file_output import output_file, refuse_existing, write_file
from gazerig.robot.recording.gaze_angles import (
    ESTIMATED,
    MOVEMENTS,
    GazeAngles,
    LabelledInterval,
    Labels,
)

_GAZE = (
    "time_s", "x_deg", "y_deg", "left_x_deg", "left_y_deg", "right_x_deg", "right_y_deg",
)  # fmt: skip
_HEAD = {
    "neck_yaw": "head_yaw_deg", "neck_pitch": "head_pitch_deg", "neck_roll": "head_roll_deg",
}  # fmt: skip
_LIDS = {
    "left_upper_lid": "left_lid", "right_upper_lid": "right_lid",
    "left_lower_lid": "left_lower_lid", "right_lower_lid": "right_lower_lid",
}  # fmt: skip
_LABELS = ("event", "movement", "target", "part")

EVENTS = ("onset_s", "duration_s", "event", "amplitude_deg", "peak_deg_s", "target", "part")
FIXATIONS = ("start_s", "duration_s", "part", "target")
"""Columns that `gazerig fit-scanpath` reads; a pursued part counts as a fixated one."""


def write_csv(
    trace: GazeAngles,
    labels: Labels,
    stretches: Sequence[LabelledInterval],
    stem: Path,
    force: bool = False,
) -> tuple[Path, ...]:
    """Write STEM_samples.csv, _events.csv, _fixations.csv and _samples.json; return their paths.

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
        [
            number(stretch.onset_s, 6),
            number(stretch.duration_s, 6),
            stretch.event,
            number(stretch.amplitude_deg, 3),
            number(stretch.peak_deg_s, 1),
            *stretch.looked_at,
        ]
        for stretch in stretches
    )
    tables: tuple[tuple[Sequence[str], Iterable[Sequence[str]]], ...] = (
        (columns(trace.joints), _sample_rows(trace, labels)),
        (EVENTS, events),
        (FIXATIONS, _fixation_rows(stretches)),
    )
    for path, (names, rows) in zip(paths[:3], tables, strict=True):
        with output_file(path, force) as file:
            writer = csv.writer(getwriter("utf-8")(file), lineterminator="\n")
            writer.writerow(names)
            writer.writerows(rows)
    write_file(paths[3], json.dumps(_basis_by_column(trace), indent=2) + "\n", force)
    return paths


def csv_files(stem: Path) -> tuple[Path, ...]:
    """Return the files that ``write_csv`` writes."""
    endings = ("samples.csv", "events.csv", "fixations.csv", "samples.json")
    return tuple(stem.with_name(f"{stem.name}_{ending}") for ending in endings)


def columns(joints: Collection[str]) -> tuple[str, ...]:
    """Return the columns of the samples of a rig with these joints.

    ``x_deg`` and ``y_deg`` are the cyclopean gaze. Lids are 0 shut .. 1 open. ``event`` is "blink"
    during a blink, otherwise the movement. ``target`` and ``part`` are the fixated object, and
    during a saccade its destination.
    """
    there = [name for joint, name in (_HEAD | _LIDS).items() if joint in joints]
    return (*_GAZE, *there, *_LABELS)


def _basis_by_column(trace: GazeAngles) -> dict[str, object]:
    """Return for each group of columns whether it was measured or estimated."""
    gaze = {"x_deg y_deg": "cyclopean", "left_*_deg": "left", "right_*_deg": "right"}
    more = {"head_*_deg": ("head", _HEAD), "*_lid": ("lids", _LIDS)}
    there = {
        key: of for key, (of, joints) in more.items() if not joints.keys().isdisjoint(trace.joints)
    }
    return {
        "joints": list(trace.joints),
        "estimated_joints": list(trace.estimated),
        "basis": {key: trace.basis(of) for key, of in (gaze | there).items()},
        "estimated": ESTIMATED,
    }


def number(value: float | None, decimals: int = 4) -> str:
    """Format a number, "" for None, NaN and infinity."""
    return "" if value is None or not isfinite(value) else f"{value:.{decimals}f}"


def _sample_rows(trace: GazeAngles, labels: Labels) -> Iterator[list[str]]:
    head = [joint in trace.joints for joint in _HEAD]
    lid = [joint in trace.joints for joint in _LIDS]
    rows = zip(
        trace.time_s.tolist(), trace.cyclopean_deg.tolist(), trace.left_deg.tolist(),
        trace.right_deg.tolist(), trace.head_deg[:, head].tolist(),
        np.hstack([trace.lids, trace.lower_lids])[:, lid].tolist(),
        labels.event(), labels.movement.tolist(), labels.looked_at.tolist(), strict=True,
    )  # fmt: skip
    for time_s, *angles, lids, event, movement, looked_at in rows:
        name = trace.names[looked_at]
        yield [
            number(time_s, 6),
            *(number(value) for pair in angles for value in pair),
            *(number(value, 3) for value in lids),
            event, MOVEMENTS[movement], name.target, name.part,
        ]  # fmt: skip


def _fixation_rows(stretches: Sequence[LabelledInterval]) -> Iterator[list[str]]:
    """Return one row per fixation, joined with pursuits of the same part up to a saccade."""
    stay: LabelledInterval | None = None
    for s in (s for s in stretches if s.event != "blink"):
        rests = s.event in ("fixation", "pursuit")
        if stay is not None and rests and s.looked_at == stay.looked_at:
            stay = stay._replace(duration_s=s.onset_s + s.duration_s - stay.onset_s)
            continue
        if stay is not None:
            yield _fixation_row(stay)
        stay = s if rests else None
    if stay is not None:
        yield _fixation_row(stay)


def _fixation_row(stay: LabelledInterval) -> list[str]:
    target, part = stay.looked_at
    return [number(stay.onset_s, 6), number(stay.duration_s, 6), part, target]

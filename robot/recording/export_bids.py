"""A run as a BIDS data set: eye-tracking recordings as physiological ones (BIDS 1.11.1).

Each of left eye (eye1), right eye (eye2) and cyclopean gaze (eye3) has a table without a
header and its JSON with the columns' names, beside a table of events; both tables are
compressed. The data set is one that the official validator accepts. The robot is the
participant; angles and signs are those of gazerig.robot.recording.gaze_angles.
"""

import gzip
import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.files.file_output import make_folder, output_file, write_file
from gazerig.gaze.types import PART_NAMES, Floats
from gazerig.robot.control.feedback_basis import ESTIMATED, PARTLY, Basis
from gazerig.robot.recording.gaze_angles import GazeAngles
from gazerig.robot.recording.gaze_labels import LabelledInterval, Labels

BIDS_VERSION = "1.11.1"

_EVENT_COLUMNS = (
    "onset", "duration", "trial_type", "amplitude", "peak_velocity", "target", "part", "message",
)  # fmt: skip
_MISSING = "n/a"
_GENERATOR = "gazerig"
_LARGEST_TEXT = 1_000_000  # bytes; of a data set's own small files
_METHODS: dict[Basis, str] = {
    "measured": "servo encoders",
    "partly estimated": f"servo encoders, {PARTLY}",
    "estimated": ESTIMATED,
}


class DatasetDescription(NamedTuple):
    """What the JSON says of a run.

    subject, task: names, made to letters and digits in file names
    rate_hz: control rate of the run; started_utc: wall clock at its start, "" where unknown
    made_by: names and versions of what recorded and wrote it
    run: number among several of one subject and task, None where there is one alone
    """

    subject: str
    task: str
    rate_hz: float
    started_utc: str
    made_by: str
    run: int | None = None


class _RecordedEye(NamedTuple):
    """One recording: its label, what it is of, its gaze and further columns."""

    label: str
    recorded: str
    gaze_deg: Floats
    more: tuple[tuple[str, str, str, Floats], ...]


def write_bids(
    trace: GazeAngles,
    labels: Labels,
    stretches: Sequence[LabelledInterval],
    about: DatasetDescription,
    root: Path,
    force: bool = False,
) -> tuple[Path, ...]:
    """Write the data set, or add this run to the one that is there; give the files.

    force: replace the run of this subject and task that is there

    Raises:
        SetupError: the folder holds another data set, or has a run of this
            subject and task, or cannot be written.
    """
    subject, task = f"sub-{label_of(about.subject)}", label_of(about.task)
    folder = root / subject / "beh"
    refuse_foreign(root, force)
    run = "" if about.run is None else f"_run-{about.run:02d}"
    stems = [folder / f"{subject}_task-{task}{run}_recording-{eye.label}" for eye in _eyes(trace)]
    for stem in stems:
        there = stem.with_name(f"{stem.name}_physio.tsv.gz")
        if there.exists() and not force:
            raise SetupError(f"{there} already exists: choose another --subject or --task")
    make_folder(folder)
    made = list(_write_frame(root, subject, about))
    for stem, eye in zip(stems, _eyes(trace), strict=True):
        made += _write_eye(stem, eye, trace, about, labels, force)
        made += _write_events(stem, trace, labels, stretches, about.task, force)
    return tuple(made)


def refuse_foreign(root: Path, force: bool = False) -> None:
    """Refuse to put a run into another data set, or among files that are none.

    Raises:
        SetupError: the folder holds something that gazerig has not made.
    """
    if force or not root.is_dir() or not any(root.iterdir()):
        return
    try:
        text = read_limited(root / "dataset_description.json", _LARGEST_TEXT).decode()
        made_by = json.loads(text).get("GeneratedBy", [])
        if any(one.get("Name") == _GENERATOR for one in made_by):
            return
    except (OSError, ValueError, AttributeError, TypeError):
        pass
    raise SetupError(
        f"{root} is there and is no data set of gazerig: name another folder, or use --force"
    )


def generated(made_by: str) -> dict[str, object]:
    """Return what a description says of a data set's making, by which it is known again."""
    return {
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": _GENERATOR, "Description": made_by}],
    }


def label_of(name: str) -> str:
    """Return a BIDS label made of a name: its letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", name) or "unnamed"


def _eyes(trace: GazeAngles) -> tuple[_RecordedEye, ...]:
    head = [
        (f"head_{name}", "deg", says, trace.head_deg[:, k])
        for k, (name, says) in enumerate(
            (("yaw", "head in space, + to its left"), ("pitch", "+ up"), ("roll", "+ right ear"))
        )
        if f"neck_{name}" in trace.joints
    ]
    return (
        _RecordedEye("eye1", "left", trace.left_deg, _lids(trace, "left", 0)),
        _RecordedEye("eye2", "right", trace.right_deg, _lids(trace, "right", 1)),
        _RecordedEye("eye3", "cyclopean", trace.cyclopean_deg, tuple(head)),
    )


def _lids(trace: GazeAngles, side: str, k: int) -> tuple[tuple[str, str, str, Floats], ...]:
    """Return the columns of one eye's lids, those that are there."""
    every = (
        ("lid", "upper", trace.lids[:, k]),
        ("lower_lid", "lower", trace.lower_lids[:, k]),
    )
    return tuple(
        (name, "1", f"opening of the {which} lid, 0 shut .. 1 open", openings)
        for name, which, openings in every
        if f"{side}_{which}_lid" in trace.joints
    )


def _write_frame(root: Path, subject: str, about: DatasetDescription) -> Iterator[Path]:
    """Write what a data set has beside its recordings; what is there of it stays."""
    description = {
        "Name": "Gaze of an animatronic head",
        **generated(about.made_by),
    }
    readme = (
        "# Gaze of an animatronic head\n\nThe participants are robots. What an eye tracker would\n"
        "have measured is taken from the angles of their servos: lines of sight in space, x + to\n"
        "the robot's own left and y + up, in degrees. Events are what the robot's models did, as\n"
        "they say themselves, moved by the lag of its eyes; amplitudes and speeds are those of\n"
        "the samples. GazeBasis tells samples that were measured from those that were estimated\n"
        "from commands, as the servos of some robots tell nothing.\n"
    )
    columns = {"species": {"Description": "what the participant is"}}
    for path, text in (
        (root / "dataset_description.json", _json(description)),
        (root / "README.md", readme),
        (root / "participants.json", _json(columns)),
    ):
        if not path.exists():
            write_file(path, text)
            yield path
    participants = root / "participants.tsv"
    known = (
        read_limited(participants, _LARGEST_TEXT).decode()
        if participants.exists()
        else "participant_id\tspecies\n"
    )
    if f"{subject}\t" not in known:
        write_file(participants, f"{known}{subject}\trobot\n", force=True)  # all of it is kept
        yield participants


def _write_eye(
    stem: Path,
    eye: _RecordedEye,
    trace: GazeAngles,
    about: DatasetDescription,
    labels: Labels,
    force: bool,
) -> tuple[Path, Path]:
    basis = trace.basis(eye.recorded)
    sidecar: dict[str, object] = {
        "TaskName": about.task,
        "Columns": ["timestamp", "x_coordinate", "y_coordinate", *(m[0] for m in eye.more)],
        "SamplingFrequency": about.rate_hz,
        "StartTime": 0.0,
        "PhysioType": "eyetrack",
        "RecordedEye": eye.recorded,
        "SampleCoordinateSystem": "gaze-in-world",
        "EyeTrackingMethod": _METHODS[basis],
        "GazeBasis": basis,
        "EstimatedJoints": list(trace.estimated),
        "ReckonedJoints": list(trace.estimated),  # the key until this version
        "Manufacturer": "gazerig",
        "ManufacturersModelName": about.subject,
        "DeviceSerialNumber": _MISSING,
        "SoftwareVersions": about.made_by,
        "RecordingStartUTC": about.started_utc or _MISSING,
        "EventLag": labels.lag_s,
        "timestamp": {"Description": "time since the first sample", "Units": "s"},
        "x_coordinate": {
            "LongName": "Gaze, horizontal",
            "Description": "yaw of the line of sight in space, + to the robot's own left; "
            "n/a where a servo gave no fresh answer",
            "Units": "deg",
        },
        "y_coordinate": {
            "LongName": "Gaze, vertical",
            "Description": "pitch of the line of sight above the level, + up",
            "Units": "deg",
        },
    }
    sidecar |= {name: {"Description": says, "Units": unit} for name, unit, says, _ in eye.more}
    values = np.column_stack([trace.time_s, eye.gaze_deg, *(m[3] for m in eye.more)])
    return _pair(f"{stem}_physio", sidecar, _even_rows(values, about.rate_hz), force)


def _even_rows(values: Floats, rate_hz: float) -> Iterator[list[str]]:
    """Return one row a slot of the control loop: n/a in slots that it missed.

    A physiological recording is sampled evenly; readers go by the number of a row.
    """
    before = float(values[0, 0])
    for time_s, *rest in values.tolist():
        missed = round((time_s - before) * rate_hz) - 1
        for k in range(1, missed + 1):
            between_s = before + k * (time_s - before) / (missed + 1)
            yield [f"{between_s:.6f}", *([_MISSING] * len(rest))]
        yield [f"{time_s:.6f}", *(_cell(value, 4) for value in rest)]
        before = time_s


def _write_events(
    stem: Path,
    trace: GazeAngles,
    labels: Labels,
    stretches: Sequence[LabelledInterval],
    task: str,
    force: bool,
) -> tuple[Path, Path]:
    rows = [
        (s.onset_s, [
            f"{s.onset_s:.6f}", f"{s.duration_s:.6f}", s.event, _cell(s.amplitude_deg, 3),
            _cell(s.peak_deg_s, 1), s.looked_at.target or _MISSING, s.looked_at.part or _MISSING,
            _MISSING,
        ])
        for s in stretches
    ]  # fmt: skip
    blank = [_MISSING] * (len(_EVENT_COLUMNS) - 2)
    rows += [
        (time_s, [f"{time_s:.6f}", *blank, " ".join(text.split())])
        for time_s, text in trace.messages
    ]
    rows.sort(key=lambda row: row[0])
    lines = (row for _, row in rows)
    return _pair(f"{stem}_physioevents", _events_sidecar(labels, task), lines, force)


def _events_sidecar(labels: Labels, task: str) -> dict[str, object]:
    return {
        "TaskName": task,
        "Columns": list(_EVENT_COLUMNS),
        "OnsetSource": "timestamp",
        "Description": "What the models of gaze did, the same for all eyes, moved by the lag of "
        f"the eyes ({1e3 * labels.lag_s:.0f} ms); blinks overlap what the eyes do. Messages are "
        "what the machine said and what people asked for.",
        "onset": {"Description": "in the time of the column timestamp", "Units": "s"},
        "duration": {"Units": "s"},
        "trial_type": {
            "Description": "kind of event, n/a of a message",
            "Levels": {
                "fixation": "the gaze rests on a still target",
                "saccade": "the gaze jumps",
                "pursuit": "the gaze follows a moving target",
                "blink": "the lids close and open",
            },
        },
        "amplitude": {"Description": "great circle from first to last sample", "Units": "deg"},
        "peak_velocity": {"Description": "fastest angular speed", "Units": "deg/s"},
        "target": {"Description": "what the gaze is on, or goes to: kind and number"},
        "part": {
            "Description": "part of a face; left and right are the face's owner's",
            "Levels": dict(PART_NAMES),
        },
        "message": {"Description": "words of the machine, or what it was asked for"},
    }


def _pair(
    stem: str, sidecar: Mapping[str, object], rows: Iterable[Sequence[str]], force: bool
) -> tuple[Path, Path]:
    table, beside = Path(f"{stem}.tsv.gz"), Path(f"{stem}.json")
    with (
        output_file(table, force) as raw,
        # Without name and time inside, the same run gives the same bytes.
        gzip.GzipFile("", "wb", 6, raw, mtime=0) as packed,
        io.TextIOWrapper(packed, encoding="utf-8", newline="") as text,
    ):
        text.writelines("\t".join(row) + "\n" for row in rows)
    write_file(beside, _json(sidecar), force)
    return table, beside


def _json(value: object) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"


def _cell(value: float | None, decimals: int) -> str:
    return _MISSING if value is None or not isfinite(value) else f"{value:.{decimals}f}"

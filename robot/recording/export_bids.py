"""Export of a run as a BIDS data set with physiological eye-tracking recordings (BIDS 1.11.1).

The left eye (eye1), the right eye (eye2) and the cyclopean gaze (eye3) each have a table of
samples without a header, a JSON file with the column names, and a table of events. Both tables
are compressed. The official validator accepts the data set. The robot is the participant.
Angles and signs are those of gazerig.robot.recording.gaze_angles.
"""

import gzip
import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.files.file_output import make_folder, output_file, write_file
from gazerig.gaze.types import PART_NAMES, Floats
from gazerig.robot.control.feedback_basis import ESTIMATED, PARTLY, Basis
from gazerig.robot.recording.export_csv import number
from gazerig.robot.recording.gaze_angles import GazeAngles, LabelledInterval, Labels

BIDS_VERSION = "1.11.1"

_EVENT_COLUMNS = (
    "onset", "duration", "trial_type", "amplitude", "peak_velocity", "target", "part", "message",
)  # fmt: skip
_MISSING = "n/a"
_GENERATOR = "gazerig"
_LARGEST_TEXT = 1_000_000  # bytes; limit for a data set's own small files
_METHODS: dict[Basis, str] = {
    "measured": "servo encoders",
    "partly estimated": f"servo encoders, {PARTLY}",
    "estimated": ESTIMATED,
}


class DatasetDescription(NamedTuple):
    """Metadata of a run.

    Attributes:
        subject, task: Names; file names contain only their letters and digits.
        rate_hz: Control rate of the run.
        started_utc: Wall clock at the start of the run, "" if unknown.
        made_by: Names and versions of the programs that recorded and wrote the run.
        run: Number among the runs of one subject and task, None for a single run.
    """

    subject: str
    task: str
    rate_hz: float
    started_utc: str
    made_by: str
    run: int | None = None


class _RecordedEye(NamedTuple):
    """One recording: its label, the recorded eye, its gaze and further columns."""

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
    """Write the data set, or add the run to an existing one.

    Args:
        trace: Gaze angles of the run.
        labels: Labels of the samples.
        stretches: Labelled intervals in the order of their onsets.
        about: Metadata of the run.
        root: Folder of the data set.
        force: Replace an existing run of this subject and task.

    Returns:
        The written files.

    Raises:
        SetupError: The folder contains another data set, contains a run of this subject
            and task, or cannot be written.
    """
    subject, task = f"sub-{bids_label(about.subject)}", bids_label(about.task)
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
    """Check that a folder is empty or contains a data set written by gazerig.

    Raises:
        SetupError: The folder contains other files.
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
        f"{root} exists and is not a data set of gazerig: use another folder, or use --force"
    )


def generated_by(made_by: str) -> dict[str, object]:
    """Return the entries of a data set's description that identify it as written by gazerig."""
    return {
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": _GENERATOR, "Description": made_by}],
    }


def bids_label(name: str) -> str:
    """Return the letters and digits of a name as a BIDS label."""
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
    """Return the columns of one eye's lids that the rig has."""
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
    """Write the files of a data set that describe it; existing ones stay."""
    description = {
        "Name": "Gaze of an animatronic head",
        **generated_by(about.made_by),
    }
    readme = (
        "# Gaze of an animatronic head\n\nThe participants are robots. The samples are computed\n"
        "from the angles of their servos: lines of sight in space, x + to the robot's own left\n"
        "and y + up, in degrees. Events are the movements that the robot's models report,\n"
        "shifted by the lag of its eyes. Amplitudes and speeds are those of the samples.\n"
        "GazeBasis distinguishes measured samples from samples that were estimated from\n"
        "commands, as the servos of some robots report no position.\n"
    )
    columns = {"species": {"Description": "species of the participant"}}
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
        "ReckonedJoints": list(trace.estimated),  # the former key, for compatibility
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
            "n/a if a servo did not answer",
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
    return _write_pair(f"{stem}_physio", sidecar, _even_rows(values, about.rate_hz), force)


def _even_rows(values: Floats, rate_hz: float) -> Iterator[list[str]]:
    """Return one row per slot of the control loop, n/a in missed slots.

    A physiological recording is sampled evenly: readers compute a row's time from its number.
    """
    before = float(values[0, 0])
    for time_s, *rest in values.tolist():
        missed = round((time_s - before) * rate_hz) - 1
        for k in range(1, missed + 1):
            between_s = before + k * (time_s - before) / (missed + 1)
            yield [f"{between_s:.6f}", *([_MISSING] * len(rest))]
        yield [f"{time_s:.6f}", *(number(value) or _MISSING for value in rest)]
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
            f"{s.onset_s:.6f}", f"{s.duration_s:.6f}", s.event,
            number(s.amplitude_deg, 3) or _MISSING, number(s.peak_deg_s, 1) or _MISSING,
            s.looked_at.target or _MISSING, s.looked_at.part or _MISSING, _MISSING,
        ])
        for s in stretches
    ]  # fmt: skip
    rows += [
        (turn.onset_s, [
            f"{turn.onset_s:.6f}", f"{turn.duration_s:.6f}", f"turn_{turn.state}", _MISSING, _MISSING,
            _MISSING if turn.partner is None else f"face {turn.partner}", _MISSING,
            " ".join(turn.text.split()) or _MISSING,
        ])
        for turn in trace.turns
    ]  # fmt: skip
    blank = [_MISSING] * (len(_EVENT_COLUMNS) - 2)
    rows += [
        (time_s, [f"{time_s:.6f}", *blank, " ".join(text.split())])
        for time_s, text in trace.messages
    ]
    rows.sort(key=lambda row: row[0])
    sidecar: dict[str, object] = {
        "TaskName": task,
        "Columns": list(_EVENT_COLUMNS),
        "OnsetSource": "timestamp",
        "Description": "Movements of the gaze models, the same for all eyes, shifted by the lag "
        f"of the eyes ({1e3 * labels.lag_s:.0f} ms). Blinks overlap movements. Messages are "
        "those of the machine and commands from people.",
        "onset": {"Description": "in the time of the column timestamp", "Units": "s"},
        "duration": {"Units": "s"},
        "trial_type": {
            "Description": "kind of event, n/a for a message",
            "Levels": {
                "fixation": "the gaze rests on a still target",
                "saccade": "the gaze moves rapidly",
                "pursuit": "the gaze follows a moving target",
                "blink": "the lids close and open",
                "turn_listening": "a voice agent reports that the partner speaks",
                "turn_thinking": "it reports that it prepares its answer",
                "turn_speaking": "it reports that the robot speaks",
                "turn_interrupted": "it reports that the partner has interrupted it",
            },
        },
        "amplitude": {"Description": "great circle from first to last sample", "Units": "deg"},
        "peak_velocity": {"Description": "fastest angular speed", "Units": "deg/s"},
        "target": {"Description": "target of the gaze or of the saccade: kind and number"},
        "part": {
            "Description": "part of a face; left and right are those of the person",
            "Levels": dict(PART_NAMES),
        },
        "message": {"Description": "message of the machine, a command to it, or spoken text"},
    }
    return _write_pair(f"{stem}_physioevents", sidecar, (row for _, row in rows), force)


def _write_pair(
    stem: str, sidecar: Mapping[str, object], rows: Iterable[Sequence[str]], force: bool
) -> tuple[Path, Path]:
    table, beside = Path(f"{stem}.tsv.gz"), Path(f"{stem}.json")
    with (
        output_file(table, force) as raw,
        # Without a name and a time in the header, the same run gives the same bytes.
        gzip.GzipFile("", "wb", 6, raw, mtime=0) as packed,
        io.TextIOWrapper(packed, encoding="utf-8", newline="") as text,
    ):
        text.writelines("\t".join(row) + "\n" for row in rows)
    write_file(beside, _json(sidecar), force)
    return table, beside


def _json(value: object) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"

"""A study as a BIDS data set: behavioural tables, and the head's recordings.

Each participant has a table of answers with its JSON (BIDS 1.11.1, behavioural experiments with no
neural recordings), and for each recording of the head the data of an eye tracker
(gazerig.robot.recording.export_bids), whose participant is then the head.
"""

import json
import shutil
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.analysis import StudyAnalysis
from gazerig.features.study.participation import AnswerRow, Participation
from gazerig.features.study.report.page import Progress
from gazerig.features.study.report.tables import as_text
from gazerig.robot.recording.export_bids import (
    DatasetDescription,
    bids_label,
    generated_by,
    refuse_foreign,
    write_bids,
)
from gazerig.robot.recording.gaze_angles import collect_gaze_angles, find_intervals, label_samples
from gazerig.robot.recording.read import RunRecording, report_bad_contents

COLUMNS = (
    "trial", "condition", "questionnaire", "question", "response", "response_time", "left_out",
)  # fmt: skip
"""Columns of a participant's table."""

_MISSING = "n/a"


class StudyDataSet(NamedTuple):
    """The written data set.

    root: its folder; files: its number of files
    left_out: damaged or missing recordings, each with the reason
    """

    root: Path
    files: int
    left_out: tuple[str, ...]


def write_study(
    study: StudyAnalysis,
    root: Path,
    folders: Sequence[Path],
    made_by: str,
    progress: Progress,
) -> StudyDataSet:
    """Write the data set; an earlier one of gazerig is replaced.

    Args:
        study: the analysis.
        root: the data set's folder.
        folders: folders of the participants with recordings, in the order of ``study.people``.
        made_by: program and version.
        progress: is called for each participant.

    Raises:
        SetupError: the folder holds other files, or a file cannot be read or written.
    """
    labels = [bids_label(one.participant) for one in study.people]
    refuse_foreign(root)
    if root.is_dir():
        shutil.rmtree(root)
    make_folder(root)
    for path, text in _frame(study, labels, made_by):
        write_file(root / path, text)
    left_out: list[str] = []
    for k, (one, label, folder) in enumerate(zip(study.people, labels, folders, strict=True)):
        progress("data set", k / len(study.people))
        _write_answers(study, one, label, root)
        left_out += _write_recordings(study, one, label, folder, root)
    progress("data set", 1.0)
    files = sum(path.is_file() for path in root.rglob("*"))
    return StudyDataSet(root, files, tuple(left_out))


def _frame(study: StudyAnalysis, labels: Sequence[str], made_by: str) -> Iterator[tuple[str, str]]:
    """Yield the files of a data set besides the participants', with their contents."""
    description = {
        "Name": study.design.title,
        **generated_by(made_by),
        "DesignSHA256": study.design_sha256,
    }
    readme = (
        f"# {study.design.title}\n\n{' '.join(study.design.description)}\n\n"
        "Each participant's answers are under beh/, one row an answer. Where the head was recorded,\n"
        "its gaze stands beside them as an eye tracker would have measured it. No name, picture\n"
        "or address of a participant is in this data set.\n"
    )
    columns = {
        "code": {"Description": "participant's code in the study"},
        "simulated": {"Description": "answers were drawn at random, nobody gave them"},
        "trial_order": {"Description": "conditions in the order in which they were shown"},
        "outcome": {"Description": "how the session ended"},
        "left_out": {"Description": "why the analysis does without the participant"},
    }
    rows = [
        [
            f"sub-{label}", one.participant, "yes" if one.simulated else "no",
            ",".join(one.order) or _MISSING, one.outcome, _text(one.left_out),
        ]
        for one, label in zip(study.people, labels, strict=True)
    ]  # fmt: skip
    yield "dataset_description.json", _json(description)
    yield "README.md", readme
    yield "participants.json", _json(columns)
    yield "participants.tsv", _tsv(["participant_id", *columns], rows)


def _write_answers(study: StudyAnalysis, one: Participation, label: str, root: Path) -> None:
    folder = root / f"sub-{label}" / "beh"
    make_folder(folder)
    stem = f"sub-{label}_task-{bids_label(study.name)}_beh"
    rows = [_row(row, one) for row in one.answers]
    write_file(folder / f"{stem}.tsv", _tsv(COLUMNS, rows))
    write_file(folder / f"{stem}.json", _json(_sidecar(study)))


def _row(row: AnswerRow, one: Participation) -> list[str]:
    trial = _MISSING if row.trial is None else str(row.trial)
    time = f"{row.ms / 1000.0:.3f}" if isfinite(row.ms) else _MISSING
    return [
        trial, _text(row.condition), row.questionnaire, f"{row.questionnaire}.{row.item}",
        _MISSING if row.value is None else _text(str(row.value)), time,
        _text(one.left_out or row.left_out),
    ]  # fmt: skip


def _sidecar(study: StudyAnalysis) -> dict[str, object]:
    items = {
        f"{key}.{name}": item.text.get(study.design.language) or item.text.get("en") or (
            f"{item.low.get('en', '')} ... {item.high.get('en', '')}"
        )
        for key, asked in study.questionnaires.items()
        for name, item in asked.items.items()
    }  # fmt: skip
    return {
        "TaskName": study.name,
        "TaskDescription": " ".join(study.design.description) or study.design.title,
        "trial": {"Description": "number of the trial from 0, practice below; n/a at the end"},
        "condition": {
            "Description": "what was shown; of a pair the first and the second",
            "Levels": {key: study.label(key) for key in study.design.conditions},
        },
        "questionnaire": {
            "Description": "which questionnaire the item is of",
            "Levels": {key: asked.source for key, asked in study.questionnaires.items()},
        },
        "question": {"Description": "which item was answered", "Levels": items},
        "response": {"Description": "the point of a rating from 1, first or second, or free text"},
        "response_time": {"Description": "from the page's appearance to the answer", "Units": "s"},
        "left_out": {"Description": "why the analysis does without the answer"},
    }


def _write_recordings(
    study: StudyAnalysis, one: Participation, label: str, folder: Path, root: Path
) -> Iterator[str]:
    """Write each recording once, in the order of the trials; yield the reasons of omissions."""
    names = dict.fromkeys(trial.recording for trial in one.trials if trial.recording)
    for number, name in enumerate(names, start=1):
        file = folder / name
        try:
            with report_bad_contents(file):
                recording = RunRecording(file)
                trace = collect_gaze_angles(recording.ticks())
                labels = label_samples(trace)
                stretches = find_intervals(trace, labels)
        except SetupError as error:  # the answers deserve their report without it
            yield str(error)
            continue
        info = recording.info
        versions = ", ".join(f"{what} {which}" for what, which in sorted(info.versions.items()))
        about = DatasetDescription(
            label, bids_label(study.name), info.rate_hz, info.started_utc, versions, number
        )
        write_bids(trace, labels, stretches, about, root)


def _tsv(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "".join("\t".join(row) + "\n" for row in [list(columns), *rows])


def _text(value: str) -> str:
    """Return a text as one cell: without tabs, line ends and formulas, n/a if it is empty."""
    return as_text(" ".join(value.split())) or _MISSING


def _json(value: object) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"

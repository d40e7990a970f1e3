"""A study's report as files: the page, tidy tables, results for programs, and a BIDS data set."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.analysis import StudyAnalysis, analyse_study
from gazerig.features.study.data_folder import InterimLook, StudyData
from gazerig.features.study.participation import collect_study
from gazerig.features.study.report.bids import StudyDataSet, write_study
from gazerig.features.study.report.page import Progress, study_page
from gazerig.features.study.report.tables import answers_csv, r_script, results_json, trials_csv

PAGE, DATA_SET = "index.html", "bids"
_MARK = b'name="generator" content="gazerig"'
_HEAD_BYTES = 4096


class StudyReport(NamedTuple):
    """A report and its files.

    page: the report; data_set: its data in BIDS format
    """

    study: StudyAnalysis
    page: Path
    data_set: StudyDataSet


def write_report(data: Path, out: Path, made_by: str, utc: str, progress: Progress) -> StudyReport:
    """Analyse the data of a study and write the report.

    An earlier report in the folder is replaced; a folder with other files is refused. An analysis
    before the planned number of participants is recorded in the data as an interim look.

    Raises:
        SetupError: the data cannot be analysed, or the folder holds other files, or a file cannot
            be written.
    """
    refuse_foreign_folder(out)
    found = collect_study(data)
    study = analyse_study(
        found.name, found.design, found.questionnaires, found.design_sha256, found.people,
        len(found.deleted),
    )  # fmt: skip
    study = add_interim_looks(study, StudyData(data), utc)
    page = study_page(study, made_by, progress)
    make_folder(out)
    for name, text in (
        ("answers.csv", answers_csv(study)),
        ("trials.csv", trials_csv(study)),
        ("results.json", results_json(study)),
        ("exploratory.R", r_script(study)),
    ):
        write_file(out / name, text, force=True)
    data_set = write_study(study, out / DATA_SET, found.folders, made_by, progress)
    write_file(out / PAGE, page, force=True)
    return StudyReport(study, out / PAGE, data_set)


def add_interim_looks(study: StudyAnalysis, data: StudyData, utc: str) -> StudyAnalysis:
    """Return a study with its interim looks; record the present one if the sample is incomplete.

    Raises:
        SetupError: it cannot be recorded.
    """
    came, planned = sum(not one.simulated for one in study.people), study.design.plan.participants
    if 0 < came < planned:
        data.add_look(InterimLook(utc, came, len(study.counted), planned))
    return replace(study, looks=data.looks())


def refuse_foreign_folder(out: Path) -> None:
    """Refuse a folder with any file that is not of an earlier report.

    Raises:
        SetupError: there is such a file.
    """
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    try:
        with (out / PAGE).open("rb") as file:
            if _MARK in file.read(_HEAD_BYTES):
                return
    except OSError:
        pass
    raise SetupError(f"{out} holds something that is no report of a study: name another with --out")

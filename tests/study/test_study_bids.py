"""A study as a BIDS data set: its tables, the head's recordings, the validator."""

import csv
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from recorded_run import record
from study_records import QUESTIONS, design, records

from gazerig.drivers.errors import SetupError
from gazerig.features.study.analysis import StudyAnalysis, analyse_study
from gazerig.features.study.journal import ItemAnswered, Record, TrialEnded
from gazerig.features.study.participation import participation
from gazerig.features.study.report.bids import StudyDataSet, write_study

pytestmark = pytest.mark.usefixtures("ideal_servos")


def study(*people: list[Record]) -> StudyAnalysis:
    of = replace(design(), description=("What is looked at", "and how it looks."))
    return analyse_study(
        "mine_1", of, QUESTIONS, "ab" * 32, [participation(p, of, QUESTIONS) for p in people]
    )


def write(one: StudyAnalysis, root: Path, folder: Path) -> StudyDataSet:
    return write_study(one, root, [folder for _ in one.people], "gazerig 0.1.0", lambda _, __: None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A participant's folder with a recording of two seconds."""
    folder = tmp_path_factory.mktemp("P001")
    record(folder / "run-01.mcap", 2.0)
    return folder


@pytest.fixture(scope="module")
def root(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    first = [
        replace(r, recording="run-01.mcap") if isinstance(r, TrialEnded) else r
        for r in records(design(), 1)
    ]
    second = [
        replace(r, value="=a\ttab\nand a line") if isinstance(r, ItemAnswered) and r.trial is None
        else replace(r, recording="gone.mcap") if isinstance(r, TrialEnded) else r
        for r in records(design(), 2)
    ]  # fmt: skip
    root = tmp_path_factory.mktemp("set") / "bids"
    write(study(first, second), root, folder)
    return root


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))


def test_the_data_set_says_what_it_is(root: Path) -> None:
    said = json.loads((root / "dataset_description.json").read_text())
    assert (said["Name"], said["BIDSVersion"]) == ("Walk against centre", "1.11.1")
    assert said["DesignSHA256"] == "ab" * 32 and said["GeneratedBy"][0]["Name"] == "gazerig"
    people = rows(root / "participants.tsv")
    assert [one["participant_id"] for one in people] == ["sub-P001", "sub-P002"]
    assert people[0]["trial_order"] in ("walk,centre", "centre,walk")
    assert set(people[0]) == {
        "participant_id",
        *json.loads((root / "participants.json").read_text()),
    }


def test_answers_are_one_row_each_and_every_column_is_described(root: Path) -> None:
    table = root / "sub-P002/beh/sub-P002_task-mine1_beh.tsv"
    found, sidecar = rows(table), json.loads(table.with_suffix(".json").read_text())
    assert len(found) == 5 and set(found[0]) <= set(sidecar)
    assert {row["question"] for row in found} <= set(sidecar["question"]["Levels"])
    assert found[-1]["response"] == "'=a tab and a line" and found[-1]["trial"] == "n/a"
    assert all(float(row["response_time"]) > 0.0 for row in found)


def test_a_recording_of_several_trials_stands_once_beside_the_answers(root: Path) -> None:
    there = sorted(path.name for path in (root / "sub-P001/beh").iterdir())
    assert "sub-P001_task-mine1_run-01_recording-eye3_physio.tsv.gz" in there
    assert len(there) == 2 + 3 * 4
    # A recording that is lost is left out; the answers are there.
    assert len(list((root / "sub-P002/beh").iterdir())) == 2


@pytest.mark.parametrize("data", [b"", b"noise" * 99, None])
def test_a_damaged_recording_is_left_out_and_named(data: bytes | None, tmp_path: Path) -> None:
    if data is not None:
        (tmp_path / "run-01.mcap").write_bytes(data)
    found = [
        replace(r, recording="run-01.mcap") if isinstance(r, TrialEnded) else r
        for r in records(design(), 1)
    ]
    made = write(study(found), tmp_path / "bids", tmp_path)
    assert made.files == 6 and len(made.left_out) == 1 and "run-01.mcap" in made.left_out[0]


def test_it_is_written_anew_over_its_own_and_over_nothing_else(
    folder: Path, tmp_path: Path
) -> None:
    root = tmp_path / "bids"
    assert write(study(records(design(), 1), records(design(), 2)), root, folder).files == 8
    assert write(study(records(design(), 2)), root, folder).files == 6
    assert not (root / "sub-P001").exists()
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    with pytest.raises(SetupError, match="not a data set of gazerig"):
        write(study(records(design(), 1)), other, folder)
    assert (other / "notes.txt").read_text() == "mine"


def test_the_official_validator_finds_no_error(root: Path) -> None:
    program = shutil.which("bids-validator-deno")
    if program is None:
        pytest.skip("no bids-validator-deno in the path: pip install bids-validator-deno")
    done = subprocess.run(
        [program, "--format", "json", "--max-rows", "-1", str(root)],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [issue for issue in issues if issue.get("severity") == "error"] == []
    assert any(issue["severity"] == "warning" for issue in issues)  # it did look

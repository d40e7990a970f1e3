"""Tests of gazerig study analyse: folders of data, good and bad, and what is written of them."""

import csv
import json
import random
from dataclasses import replace
from pathlib import Path

import pytest
from study_records import QUESTIONS, UTC, design, pairs, records

from gazerig.drivers.errors import SetupError
from gazerig.features.study.analysis import analyse_study
from gazerig.features.study.cli.analyse import verdicts
from gazerig.features.study.collected import collect_study
from gazerig.features.study.data_folder import StudyData, code_of
from gazerig.features.study.design import Condition, Exclusion, StudyDesign
from gazerig.features.study.journal import FILE, Journal
from gazerig.features.study.preregistration import canonical
from gazerig.features.study.records import Opened, Record, TrialBegan
from gazerig.features.study.report.page import banners
from gazerig.features.study.report.report import add_interim_looks, write_report
from gazerig.features.study.report.tables import results_json
from gazerig.features.study.simulation import Population

TWO = ("walk", "centre")
SHOWN = {"walk": {"gaze.scanpath.model": "markov"}, "centre": {"gaze.scanpath.model": "simple"}}


def text_of(study: StudyDesign) -> bytes:
    keys = {*study.questionnaires, *study.after}
    return canonical(study, {key: QUESTIONS[key] for key in QUESTIONS if key in keys}, SHOWN)


def kept(folder: Path, study: StudyDesign, count: int, cut: int | None = None) -> StudyData:
    """Write the data of simulated participants; the last one's records end at ``cut``."""
    data = StudyData(folder)
    sha256 = data.claim("mine", text_of(study))
    for number in range(1, count + 1):
        found: list[Record] = records(study, number, Population(1.2), sha256=sha256)
        with Journal(data.participant(number)) as journal:
            journal.write(found[: cut if number == count else None])
    return data


def analyse(folder: Path) -> None:
    write_report(folder, folder / "report", "gazerig 0.1.0", UTC, nothing)


def nothing(what: str, share: float) -> None:
    pass


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mine-data")
    kept(folder, design(participants=12), 12)
    analyse(folder)
    return folder


def test_a_folder_gives_back_the_design_and_all_answers(data: Path) -> None:
    found = collect_study(data)
    wanted = design(participants=12)
    # Names of rigs and films are replaced by their values, which the analysis does not need.
    assert found.design == wanted and found.name == "mine"
    assert list(found.questionnaires["paper"].items) == ["naturalness", "looked_at"]
    assert [one.participant for one in found.people] == [code_of(k) for k in range(1, 13)]
    assert len(found.folders) == 12 and found.deleted == ()


def test_the_order_of_conditions_and_items_is_kept(tmp_path: Path) -> None:
    turned = replace(design(), conditions={"walk": Condition(), "centre": Condition()})
    swapped = dict(reversed(list(turned.conditions.items())))
    kept(tmp_path / "one", replace(turned, conditions=swapped), 1)
    assert list(collect_study(tmp_path / "one").design.conditions) == ["centre", "walk"]


def test_the_report_has_its_page_tables_and_results(data: Path) -> None:
    report = data / "report"
    assert "<title>Walk against centre</title>" in (report / "index.html").read_text()
    rows = list(csv.DictReader((report / "answers.csv").open()))
    assert len(rows) == 12 * 5
    assert json.loads((report / "results.json").read_text())["participants"]["came"] == 12


def test_the_bids_data_set_has_a_table_for_each_participant(data: Path) -> None:
    root = data / "report" / "bids"
    people = list(csv.DictReader((root / "participants.tsv").open(), delimiter="\t"))
    assert len(people) == 12 and people[0]["participant_id"] == "sub-P001"
    table = root / "sub-P001" / "beh" / "sub-P001_task-mine_beh.tsv"
    rows = list(csv.DictReader(table.open(), delimiter="\t"))
    assert {row["condition"] for row in rows} == {"walk", "centre", "n/a"}
    sidecar = json.loads(table.with_suffix(".json").read_text())
    assert set(rows[0]) <= set(sidecar) and sidecar["TaskName"] == "mine"
    assert set(sidecar["condition"]["Levels"]) == {"walk", "centre"}


def test_it_can_be_run_again_and_the_same_data_give_the_same_bytes(data: Path) -> None:
    report = data / "report"
    before = {p: p.read_bytes() for p in report.rglob("*") if p.is_file()}
    analyse(data)
    assert before == {p: p.read_bytes() for p in report.rglob("*") if p.is_file()}


def test_who_was_deleted_is_gone_from_what_is_made_again(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 4)
    analyse(tmp_path)
    data.delete(2)
    analyse(tmp_path)
    written = b"".join(p.read_bytes() for p in (tmp_path / "report").rglob("*") if p.is_file())
    assert b"P001" in written and b"P002" not in written
    assert collect_study(tmp_path).deleted == ("P002",)


def test_an_unfinished_participant_is_left_out_or_kept_by_the_rule(tmp_path: Path) -> None:
    kept(tmp_path / "a", design(), 3, cut=-2)
    assert [p.left_out for p in collect_study(tmp_path / "a").people] == ["", "", "did not finish"]
    kept(tmp_path / "b", replace(design(), exclusion=Exclusion(incomplete="keep")), 3, cut=-2)
    assert not any(p.left_out for p in collect_study(tmp_path / "b").people)


def test_a_torn_line_is_no_record_and_hinders_nothing(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 2)
    journal = data.participant(1) / FILE
    whole = collect_study(tmp_path)
    with journal.open("ab") as file:
        file.write(b'[{"kind": "Closed", "how": "wit')
    assert collect_study(tmp_path) == whole


def test_a_damaged_line_is_named_with_its_number(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 1)
    journal = data.participant(1) / FILE
    journal.write_bytes(journal.read_bytes() + b"nonsense\n")
    with pytest.raises(SetupError, match=r"P001/journal\.jsonl:2: .*damaged"):
        analyse(tmp_path)


JUNK: tuple[object, ...] = (None, -1, 99, "x", "a|b", [], {})


def test_whatever_a_damaged_journal_holds_is_one_message_and_nothing_is_lost(
    tmp_path: Path,
) -> None:
    """Every field of every record, taken out or replaced by what is not expected."""
    of = pairs(TWO)
    data = kept(tmp_path, of, 1)
    path = data.participant(1) / FILE
    whole = json.loads(path.read_bytes())
    each = {one["kind"]: at for at, one in enumerate(whole)}
    whole.insert(0, whole.pop(each["Opened"]))
    refused = 0
    for at in {*each.values(), len(whole) - 2}:
        for field in whole[at]:
            for value in (*JUNK, "taken out"):
                changed = {**whole[at], field: value}
                if value == "taken out":
                    del changed[field]
                line = json.dumps([*whole[:at], changed, *whole[at + 1 :]]).encode() + b"\n"
                path.write_bytes(line)
                try:
                    found = collect_study(tmp_path)
                    analyse_study("m", found.design, found.questionnaires, "ab", found.people)
                except SetupError as error:
                    assert "P001" in str(error) and "\n" not in str(error)
                    refused += 1
                assert path.read_bytes() == line
    assert refused > 100


def test_a_journal_that_lost_a_line_is_refused(tmp_path: Path) -> None:
    """Else the recording of a presentation that did not begin would be measured."""
    data = StudyData(tmp_path)
    of = design()
    sha256 = data.claim("mine", text_of(of))
    without = [r for r in records(of, 1, sha256=sha256) if not isinstance(r, TrialBegan)]
    with Journal(data.participant(1)) as journal:
        journal.write(without)
    with pytest.raises(SetupError, match="record 3, TrialEnded: the presentation did not begin"):
        collect_study(tmp_path)


def test_bytes_of_a_journal_that_are_wrong_are_one_message_and_nothing_is_lost(
    tmp_path: Path,
) -> None:
    data = kept(tmp_path, design(), 1)
    path = data.participant(1) / FILE
    whole, rng = path.read_bytes(), random.Random(0)
    refused = 0
    for _ in range(150):
        at, length = rng.randrange(len(whole)), rng.choice((0, 1, 1, 40))
        junk = rng.choice((b"", b"\x00", b"\xff", b"\n", b"[" * 2000, b'"', b"}", b"1e999"))
        damaged = whole[:at] + junk + whole[at + length :]
        path.write_bytes(damaged)
        try:
            collect_study(tmp_path)
        except SetupError as error:
            refused += "\n" not in str(error)
        assert path.read_bytes() == damaged
        try:
            with Journal(path.parent) as journal:
                torn = b"" if journal.torn is None else journal.torn.read_bytes()
                assert path.read_bytes() + torn == damaged
        except SetupError:
            assert path.read_bytes() == damaged
    assert refused > 100


def real(folder: Path, count: int) -> StudyData:
    """Write the data of people of a study of 12."""
    of = design(participants=12)
    data = StudyData(folder)
    sha256 = data.claim("mine", text_of(of))
    for number in range(len(data.numbers()) + 1, count + 1):
        first, *rest = records(of, number, Population(1.2), sha256=sha256)
        assert isinstance(first, Opened)
        with Journal(data.participant(number)) as journal:
            journal.write([replace(first, simulated=False), *rest])
    return data


def test_a_look_before_the_planned_sample_is_kept_in_the_data_and_reported(tmp_path: Path) -> None:
    # The same people once more are no other look, and the whole sample is none.
    for day, count in ((1, 3), (2, 3), (3, 5), (9, 12)):
        data, found = real(tmp_path, count), collect_study(tmp_path)
        study = analyse_study("m", found.design, found.questionnaires, "ab", found.people)
        study = add_interim_looks(study, data, f"2026-11-0{day}T10:00:00Z")
    looks = [("2026-11-01T10:00:00Z", 3, 3, 12), ("2026-11-03T10:00:00Z", 5, 5, 12)]
    assert list(data.looks()) == looks
    (said,) = banners(study)
    assert "2026-11-01, n = 3; 2026-11-03, n = 5" in said
    results = json.loads(results_json(study))
    assert [tuple(look.values()) for look in results["interim_looks"]] == looks
    (tmp_path / "interim-looks.jsonl").write_text("{}\n")
    with pytest.raises(SetupError, match=r"interim-looks.jsonl cannot be read"):
        add_interim_looks(study, data, UTC)


@pytest.mark.usefixtures("unlaid_figures")
def test_the_command_records_a_look_once(tmp_path: Path) -> None:
    data = real(tmp_path, 2)
    analyse(tmp_path)
    assert [look[1:] for look in data.looks()] == [(2, 2, 12)]


def test_a_look_at_simulated_participants_is_none(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 2)
    found = collect_study(tmp_path)
    study = analyse_study("m", found.design, found.questionnaires, "ab", found.people)
    assert not add_interim_looks(study, data, UTC).looks and not data.looks()


def test_data_of_two_designs_are_refused_with_both_hashes(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 2)
    with Journal(data.participant(3)) as journal:
        journal.write(records(design(), 3, sha256="f" * 64))
    with pytest.raises(SetupError, match=r"P003 was recorded with another design \(ffffffffffff\)"):
        analyse(tmp_path)


def test_an_edited_design_is_refused(tmp_path: Path) -> None:
    kept(tmp_path, design(), 1)
    path = tmp_path / "design.json"
    path.write_text(path.read_text().replace('"alpha": 0.05', '"alpha": 0.2'))
    with pytest.raises(SetupError, match="changed"):
        analyse(tmp_path)


def test_a_folder_without_a_study_or_participants_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"no data of a study"):
        analyse(tmp_path)
    kept(tmp_path, design(), 0)
    with pytest.raises(SetupError, match=r"no participant yet: gazerig study run"):
        analyse(tmp_path)


def test_a_folder_of_somebody_else_is_not_written_to(tmp_path: Path) -> None:
    kept(tmp_path, design(), 1)
    there = tmp_path / "report"
    there.mkdir()
    (there / "thesis.txt").write_text("mine")
    with pytest.raises(SetupError, match="no report of a study"):
        analyse(tmp_path)
    assert [p.name for p in there.iterdir()] == ["thesis.txt"]


def test_the_terminal_says_what_became_of_each_hypothesis(data: Path) -> None:
    report = write_report(data, data / "report", "gazerig 0.1.0", UTC, lambda _, __: None)
    lines = verdicts(report.study)
    assert lines[0] == "12 of 12 participants count"
    assert lines[1].startswith("naturalness: walk > centre: supported (corrected p = ")

"""The data of a study: one design, participants without names, one command that deletes one."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from gazerig.drivers.errors import SetupError
from gazerig.features.study.data_folder import StudyData, code_of
from gazerig.features.study.journal import FILE, Journal, read
from gazerig.features.study.records import Closed, ItemAnswered, Opened
from gazerig.features.study.run.participant import open_journal
from gazerig.features.study.run.simulated_session import simulate_study
from gazerig.features.study.run.study_file import LoadedStudy, load_study
from gazerig.features.study.simulation import Population


@pytest.fixture(scope="module")
def study() -> LoadedStudy:
    return load_study("nakamoto_1")


def edited(study: LoadedStudy) -> LoadedStudy:
    trials = replace(study.design.trials, seconds=31.0)
    return replace(study, design=replace(study.design, trials=trials))


def simulated(study: LoadedStudy, folder: Path, count: int = 3, seed: int = 0) -> StudyData:
    data = StudyData(folder)
    simulate_study(study, data, count, Population(seed=seed))
    return data


def test_simulated_participants_finish_and_the_same_seed_gives_the_same_journals(
    study: LoadedStudy, tmp_path: Path
) -> None:
    one = simulated(study, tmp_path / "a")
    again, other = simulated(study, tmp_path / "b"), simulated(study, tmp_path / "c", seed=1)
    assert one.numbers() == (1, 2, 3)
    texts = [
        [(data.participant(n) / FILE).read_bytes() for n in (1, 2, 3)]
        for data in (one, again, other)
    ]
    assert texts[0] == texts[1] != texts[2]
    for number in one.numbers():
        records = read(one.participant(number))
        assert isinstance(records[0], Opened) and records[0].simulated
        assert isinstance(records[-1], Closed) and records[-1].how == "finished"
        assert sum(isinstance(record, ItemAnswered) for record in records) == 2 * 2 + 1


def test_simulated_ones_are_not_put_beside_others(study: LoadedStudy, tmp_path: Path) -> None:
    data = simulated(study, tmp_path)
    with pytest.raises(SetupError, match="has data of participants: .* --data NEW_FOLDER"):
        simulate_study(study, data, 1, Population())


def test_a_design_edited_after_the_first_participant_is_refused(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = simulated(study, tmp_path)
    assert data.claim(study.name, study.canonical) == study.sha256
    changed = edited(study)
    with pytest.raises(SetupError, match=f"{study.sha256[:12]}; this one is {changed.sha256[:12]}"):
        data.claim(changed.name, changed.canonical)
    StudyData(tmp_path / "new").claim(changed.name, changed.canonical)
    with pytest.raises(SetupError, match="was begun with another design"):
        open_journal(changed, data, 1, changed.sha256)


def test_what_is_said_of_the_design_cannot_be_changed_unseen(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = StudyData(tmp_path)
    data.claim(study.name, study.canonical)
    path = tmp_path / "design.json"
    stated = json.loads(path.read_text(encoding="utf-8"))
    stated["design"]["design"]["trials"]["seconds"] = 5.0
    path.write_text(json.dumps(stated), encoding="utf-8")
    with pytest.raises(SetupError, match="was changed: its design does not have the hash"):
        data.sha256()
    path.write_text("{", encoding="utf-8")
    with pytest.raises(SetupError, match="cannot be read"):
        data.sha256()
    with pytest.raises(SetupError, match="has no data of a study"):
        StudyData(tmp_path / "nowhere").sha256()


def test_deleting_a_participant_leaves_nothing_but_the_code(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = simulated(study, tmp_path)
    folder = data.participant(2)
    (folder / "run-01.mcap").write_bytes(b"joints")
    for made in ("report/index.html", "bids/sub-P002/beh/a.tsv"):
        (tmp_path / made).parent.mkdir(parents=True)
        (tmp_path / made).write_text("P002")
    with Journal(folder), pytest.raises(SetupError, match="P002 has a session already"):
        data.delete(2)
    assert data.delete(2) == 5
    assert not folder.exists() and not (tmp_path / "report").exists()
    left = [one for one in tmp_path.rglob("*") if one.is_file()]
    assert [one.name for one in left if b"P002" in one.read_bytes()] == ["deleted.txt"]
    assert data.deleted() == ("P002",) and data.numbers() == (1, 3)
    with pytest.raises(SetupError, match="has nothing of P002; there is P001, P003"):
        data.delete(2)
    with pytest.raises(SetupError, match="the data of P002 were deleted on request"):
        open_journal(study, data, 2, study.sha256)


def test_a_participant_with_a_damaged_journal_can_be_deleted(
    study: LoadedStudy, tmp_path: Path
) -> None:
    data = simulated(study, tmp_path)
    (data.participant(2) / FILE).write_bytes(b"nonsense\n")
    with pytest.raises(SetupError, match="damaged"):
        open_journal(study, data, 2, study.sha256)
    assert data.delete(2) and data.numbers() == (1, 3)


def test_participants_have_numbers_and_no_names() -> None:
    assert [code_of(7), code_of(1234)] == ["P007", "P1234"]
    for number in (0, -1, 1_000_000):
        with pytest.raises(SetupError, match="a whole number from 1 to 999999; no names"):
            code_of(number)


def test_the_secret_stays_and_is_the_owners_alone(tmp_path: Path) -> None:
    data = StudyData(tmp_path)
    assert data.secret() == data.secret() and len(data.secret()) == 32
    assert (tmp_path / "secret").stat().st_mode & 0o077 == 0
    (tmp_path / "secret").write_text("what")
    with pytest.raises(SetupError, match="secret cannot be read"):
        data.secret()

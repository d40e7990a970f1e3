"""The journal of a participant: on disk before anybody goes on, whole or not at all."""

import errno
import os
from math import isnan, nan
from pathlib import Path

import pytest

from gazerig.drivers.errors import SetupError
from gazerig.features.study.journal import FILE, Journal, WriteFailed, encode_records, read
from gazerig.features.study.records import (
    Closed,
    Consented,
    ItemAnswered,
    Measured,
    Opened,
    Record,
    TrialBegan,
    TrialEnded,
)

UTC = "2026-01-01T00:00:00+00:00"
ALL: tuple[Record, ...] = (
    Opened("P001", "ab" * 32, ("a", "b|c"), "0.1", UTC),
    Consented(True, False, True, UTC),
    TrialBegan(-1, 0, "a", UTC),
    TrialEnded(-1, 0, "head_lost", 3.5, UTC, 1, "run-01.mcap", "servo 3", 1.0, 4.5),
    ItemAnswered(0, "b|c", "choice", "alive", "first", 812.5, UTC),
    ItemAnswered(None, "", "free_text", "what", 'schön\n"ja" 目', 1.0, UTC),
    Measured(0, "b", {"first_look_s": 1.5}, 1, 2),
    Closed("finished", "", UTC),
)


def test_all_kinds_of_records_come_back(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for one in ALL:
            journal.write((one,))
        assert journal.records == ALL
    assert read(tmp_path) == ALL
    with Journal(tmp_path) as journal:
        assert journal.records == ALL and journal.torn is None


def test_what_is_not_a_number_comes_back_as_that(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.write((Measured(0, "a", {"x": nan}), TrialEnded(0, 0, "interrupted", nan, UTC)))
    measured, ended = read(tmp_path)
    assert isinstance(measured, Measured) and isnan(measured.values["x"])
    assert isinstance(ended, TrialEnded) and isnan(ended.seconds) and isnan(ended.from_s)


def test_a_step_is_there_whole_or_not_at_all_wherever_it_was_cut(tmp_path: Path) -> None:
    """As after a crash or a lost power: the file ends at any byte of the last line."""
    whole, step = encode_records(ALL[:3]), encode_records(ALL[3:5])
    for cut in range(len(step)):
        folder = tmp_path / str(cut)
        folder.mkdir()
        (folder / FILE).write_bytes(whole + step[:cut])
        assert read(folder) == ALL[:3]
        with Journal(folder) as journal:
            assert journal.records == ALL[:3]
            assert (journal.torn is None) == (cut == 0)
            if journal.torn is not None:
                assert journal.torn.read_bytes() == step[:cut]
            journal.write(ALL[3:5])
        assert read(folder) == ALL[:5]


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(
        encode_records(ALL[:1]) + b'[{"kind": "Rumour"}]\n' + encode_records(ALL[1:2])
    )
    with pytest.raises(SetupError, match=rf"{FILE}:2: no records of a session"):
        Journal(tmp_path)
    with pytest.raises(SetupError, match=rf"{FILE}:2:"):
        read(tmp_path)


def test_two_sessions_of_one_participant_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "P007"
    with Journal(folder), pytest.raises(SetupError, match="P007 has a session already"):
        Journal(folder)
    with Journal(folder) as journal:
        journal.write(ALL[:1])


def test_a_full_disk_keeps_nothing_by_halves_and_may_be_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Journal(tmp_path) as journal:
        journal.write(ALL[:2])
        there, room = os.write, [60]

        def full(fd: int, data: bytes) -> int:
            if not room[0]:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            part = data[: room[0]]
            room[0] -= len(part)
            return there(fd, part)

        monkeypatch.setattr(os, "write", full)
        with pytest.raises(WriteFailed, match="not kept: No space left on device"):
            journal.write(ALL[2:5])
        assert journal.records == ALL[:2] == read(tmp_path)
        monkeypatch.setattr(os, "write", there)
        journal.write(ALL[2:5])
    assert read(tmp_path) == ALL[:5]


def test_no_journal_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="No such file"):
        read(tmp_path / "P009")


def test_only_the_owner_may_read_it(tmp_path: Path) -> None:
    with Journal(tmp_path):
        assert (tmp_path / FILE).stat().st_mode & 0o077 == 0

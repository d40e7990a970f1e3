"""A file edited by hand counts once it is whole, however the editor writes it."""

import os
import threading
from pathlib import Path

import pytest

from gazerig.robot.net.live_server import FileWatch

OLD = "name: old\n"
NEW = "name: new\n"


class Rig:
    """One watched file, and the reports about it."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "rig.yaml"
        self.path.write_text(OLD)
        self.reported: list[str] = []
        self.watch = FileWatch(lambda: [self.path], self._changed)
        self.watch.look()

    def _changed(self, path: Path) -> None:
        assert path == self.path
        self.reported.append(path.read_text() if path.exists() else "(gone)")

    def looks(self, number: int) -> list[str]:
        for _ in range(number):
            self.watch.look()
        return self.reported

    def write(self, text: str) -> None:
        self.path.write_text(text)


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return Rig(tmp_path)


def test_a_new_content_is_told_once_after_it_was_seen_twice(rig: Rig) -> None:
    rig.write(NEW)
    assert rig.looks(1) == []
    assert rig.looks(1) == [NEW]
    assert rig.looks(20) == [NEW]


def test_touch_is_no_news(rig: Rig) -> None:
    os.utime(rig.path, (1.0, 1.0))
    assert rig.looks(5) == []


def test_same_time_and_size_but_other_content_is_news(rig: Rig) -> None:
    stat = rig.path.stat()
    rig.write(NEW)
    os.utime(rig.path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert rig.path.stat().st_mtime_ns == stat.st_mtime_ns and len(OLD) == len(NEW)
    assert rig.looks(3) == [NEW]


def test_an_editor_that_renames_a_new_file_over_it(rig: Rig) -> None:
    beside = rig.path.with_suffix(".tmp")
    beside.write_text(NEW)
    beside.replace(rig.path)
    assert rig.looks(3) == [NEW]


@pytest.mark.parametrize("looks_without", [1, 3, 5])
def test_an_editor_that_removes_it_for_a_moment(rig: Rig, looks_without: int) -> None:
    rig.path.rename(rig.path.with_suffix(".bak"))
    assert rig.looks(looks_without) == []
    rig.write(NEW)
    assert rig.looks(3) == [NEW]


@pytest.mark.parametrize("first", ["", "name: ne"], ids=["empties it", "cuts a line"])
def test_an_editor_that_empties_it_first_or_writes_in_pieces(rig: Rig, first: str) -> None:
    rig.write(first)
    assert rig.looks(4) == []
    rig.write(NEW)
    assert rig.looks(3) == [NEW]


def test_a_file_that_stays_away_is_told_once_and_so_is_its_return(rig: Rig) -> None:
    rig.path.unlink()
    assert rig.looks(20) == ["(gone)"]
    rig.write(OLD)
    assert rig.looks(20) == ["(gone)", OLD]


def test_what_the_program_saved_itself_is_no_news(rig: Rig) -> None:
    rig.write(NEW)
    rig.looks(1)
    rig.watch.saved(rig.path)
    assert rig.looks(10) == []
    rig.write(OLD)
    assert rig.looks(3) == [OLD]


def test_the_thread_looks_by_itself_and_ends(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(OLD)
    reported = threading.Event()
    watch = FileWatch(lambda: [path], lambda _: reported.set())
    watch.start()
    path.write_text(NEW)
    assert reported.wait(10.0)
    watch.stop()
    assert "file watch" not in [thread.name for thread in threading.enumerate()]

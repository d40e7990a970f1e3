"""Files edited by hand are read again or refused in words; without a socket the head still runs."""

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from gazerig.config.load import ConfigError, ConfigFault
from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.commands import Command
from gazerig.robot.remote.client import connect_to_all
from gazerig.robot.remote.live_server import LiveServer


class Robot:
    """A robot that accepts commands and ignores them."""

    def command(self, command: Command) -> None:
        raise ValueError("it cannot move a head")

    def menus(self) -> dict[str, tuple[str, ...]]:
        return {}

    def tracks(self) -> tuple[TrackInfo, ...]:
        return ()


class FileOnly:
    """Tuning whose one value is the text of a file; "wrong" in it is refused."""

    def __init__(self, path: Path) -> None:
        self.path, self.version, self.text, self.lost = path, 0, "", False

    def files(self) -> Sequence[Path]:
        if self.lost:
            raise ConfigError([ConfigFault(str(self.path), None, "", "not now")])
        return (self.path,)

    def reload(self, path: Path) -> tuple[str, ...]:
        text = path.read_text(encoding="utf-8")
        if "wrong" in text:
            rules = ("a is above 1", "b: unknown key")
            raise ConfigError(ConfigFault(str(path), 1, "", rule) for rule in rules)
        before, self.text = self.text, text
        self.version += text != before
        return (f"text = {text.strip()}",) if text != before else ()


class Rig:
    """A live control whose looks at its file are ours."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "my.yaml"
        self.path.write_text("first\n", encoding="utf-8")
        self.tuning = FileOnly(self.path)
        self.said: list[str] = []
        self.live = LiveServer(
            Robot(),  # type: ignore[arg-type]
            self.tuning,  # type: ignore[arg-type]
            (ConfigError,),
            SimulatedClock(),
            {"rig": "my.yaml", "pid": 1},
            self.said.append,
        )

    def written(self, text: str) -> str:
        """Write the file, check until it is read, and return the last message."""
        self.path.write_text(text, encoding="utf-8")
        for _ in range(3):
            self.live._watch.look()
        return self.said[-1]


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    place = Path(tempfile.mkdtemp(prefix="gz-", dir="/tmp"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(place))
    yield place
    shutil.rmtree(place)


@pytest.fixture
def rig(folder: Path) -> Iterator[Rig]:
    made = Rig(folder)
    made.live.open()
    yield made
    made.live.close()


def test_it_listens_and_says_nothing_while_all_is_well(rig: Rig) -> None:
    (found,) = connect_to_all()
    found.close()
    assert rig.said == []


def test_an_edited_file_is_read_again_and_what_changed_is_said(rig: Rig) -> None:
    assert rig.written("second\n") == (
        f"{rig.path} was edited: its values are applied\ntext = second"
    )
    assert rig.tuning.text == "second\n"


def test_a_wrong_file_is_refused_with_every_fault_and_the_next_good_one_taken(rig: Rig) -> None:
    rig.written("second\n")
    said = rig.written("wrong\n").splitlines()
    assert said[0] == f"{rig.path} changed but has errors; the previous values stay:"
    assert [line.rpartition(": ")[2] for line in said[1:]] == ["a is above 1", "unknown key"]
    assert rig.tuning.text == "second\n"
    assert "values are applied" in rig.written("third\n")


def test_a_file_that_went_away_is_said_and_the_values_stay(rig: Rig) -> None:
    rig.written("second\n")
    rig.path.unlink()
    for _ in range(20):
        rig.live._watch.look()
    assert "the previous values stay" in rig.said[-1] and "No such file" in rig.said[-1]
    assert rig.tuning.text == "second\n" and len(rig.said) == 2


def test_without_a_socket_it_says_so_and_watches_the_file(folder: Path) -> None:
    (folder / "gazerig").write_text("in the way", encoding="utf-8")
    rig = Rig(folder)
    rig.live.open()
    try:
        assert rig.said[0].startswith("gazerig ctl set and stop cannot find this rig: ")
        assert "values are applied" in rig.written("second\n")
    finally:
        rig.live.close()

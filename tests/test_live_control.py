"""Files edited by hand are read again or refused in words; without a socket the head still runs."""

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from fakes.runs import simulated
from slow_rigs import at_rate

from gazerig.config.rig_files import RigLayers
from gazerig.robot.model.commands import Command, Tune
from gazerig.robot.net.client import connect_to_all
from gazerig.robot.net.live_server import LiveServer
from gazerig.robot.run.live import ParamStore

pytestmark = pytest.mark.usefixtures("ideal_servos")
RATE = "loop.rate_hz"


class Rig:
    """A live control whose looks at its file are ours."""

    def __init__(self, folder: Path) -> None:
        self.path = Path(at_rate(folder, "desk", 80.0))
        made = simulated(str(self.path))
        self._made = made
        self.tuning = ParamStore(made.rig, self._apply, RigLayers(str(self.path), None, None))
        self.said: list[str] = []
        about = {"rig": "desk", "pid": 1}
        self.live = LiveServer(made.robot, self.tuning, made.clock, about, self.said.append)

    def _apply(self, order: Command) -> None:
        assert isinstance(order, Tune)
        self._made._tune(order, 0.0)

    def look(self) -> str:
        """Look at the file until it counts, and return the last message."""
        for _ in range(20):
            self.live._watch.look()
        return self.said[-1]

    def written(self, rate_hz: float) -> str:
        at_rate(self.path.parent, "desk", rate_hz)
        return self.look()

    @property
    def rate_hz(self) -> object:
        return self.tuning.get(RATE)[RATE]


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


def test_an_edited_file_is_read_again_and_what_changed_is_said(rig: Rig) -> None:
    (found,) = connect_to_all()
    found.close()
    assert rig.said == []
    assert rig.written(90.0) == (
        f"{rig.path} was edited: its values are applied\n{RATE} = 90.0 (at the next start)"
    )
    assert rig.rate_hz == 90.0


def test_a_wrong_file_is_refused_with_every_fault_and_the_next_good_one_taken(rig: Rig) -> None:
    rig.written(90.0)
    with rig.path.open("a") as file:
        file.write("nonsense: 1\nmore: 2\n")
    first, *faults = rig.look().splitlines()
    assert first == f"{rig.path} changed but has errors; the previous values stay:"
    assert len(faults) == 2 and all("unknown key" in line for line in faults)
    assert rig.rate_hz == 90.0
    assert "values are applied" in rig.written(100.0)


def test_a_file_that_went_away_is_said_and_the_values_stay(rig: Rig) -> None:
    rig.written(90.0)
    rig.path.unlink()
    rig.look()
    assert "the previous values stay" in rig.look() and "No such file" in rig.said[-1]
    assert rig.rate_hz == 90.0 and len(rig.said) == 2


def test_without_a_socket_it_says_so_and_watches_the_file(folder: Path) -> None:
    (folder / "gazerig").write_text("in the way")
    rig = Rig(folder)
    rig.live.open()
    try:
        assert rig.said[0].startswith("gazerig ctl set and stop cannot find this rig: ")
        assert "values are applied" in rig.written(90.0)
    finally:
        rig.live.close()

"""``gazerig run`` is tuned, steered and stopped from other programs, and reads its file again."""

import os
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from branch import Branch, gazerig

from gazerig.config.save import copy_shipped
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import DriverError
from gazerig.robot.remote.client import NoRobotError, RequestRejected, RobotClient
from gazerig.robot.remote.socket_io import find_sockets, socket_folder

RATE = "loop.rate_hz"
ROOT = Path(__file__).parents[1]

"""A client waits for its answer, and the park for the servos, only for a bounded time."""


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder for the rig's file and its socket; pytest's own are too long for a socket."""
    found = Path(tempfile.mkdtemp(prefix="gz-", dir="/tmp"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(found))
        yield found
    shutil.rmtree(found)


class Run:
    """``gazerig run`` on an emulated bus, its words in a file."""

    def __init__(self, place: Path) -> None:
        self.file, self.log = place / "my.yaml", place / "log"
        if not self.file.exists():
            copy_shipped("desk", self.file)
        with self.log.open("w") as log:
            work = gazerig("run", str(self.file), "--mock", "--no-page")
            self.process = Branch(work, stderr=log)

    def connected(self) -> RobotClient:
        for _ in range(600):
            assert self.process.poll() is None, self.words()
            try:
                rig = RobotClient.connect(self.process.pid)
            except NoRobotError:
                time.sleep(0.05)
                continue
            if rig.status()["ticks"]:
                return rig
            rig.close()
        pytest.fail("it cannot be reached")

    def words(self) -> str:
        return self.log.read_text(encoding="utf-8")

    def hears(self, words: str) -> bool:
        for _ in range(400):
            if words in self.words():
                return True
            time.sleep(0.05)
        return False

    def end(self, with_signal: int) -> int:
        self.process.send_signal(with_signal)
        return self.process.wait(timeout=30.0)


@pytest.fixture
def run(place: Path) -> Iterator[Run]:
    run = Run(place)
    yield run
    if run.process.poll() is None:
        run.end(signal.SIGKILL)


@pytest.mark.slow
def test_it_is_tuned_stopped_and_goes_on(run: Run) -> None:
    with run.connected() as rig:
        assert rig.status()["rig"] == str(run.file)
        assert rig.set(RATE, 150.0) == (f"{RATE} = 150.0",)
        assert [change.key for change in rig.unsaved()] == [RATE]
        rig.look_at(1.0, 0.3, 0.0)
        assert rig.status()["why"].endswith("makes it look at 1 0.3 0")
        rig.stop("finger")
        assert rig.status()["stopped"] == "finger"
        with pytest.raises(RequestRejected, match="lasts at least 2 s"):
            rig.resume()
        time.sleep(2.1)
        rig.resume()
        assert rig.status()["stopped"] == ""
        rig.save()
    assert load_rig(str(run.file)).loop.rate_hz == 150.0
    assert run.hears(f"stopped by process {os.getpid()}: finger; torque off")


def test_ctrl_c_parks_and_removes_the_socket(run: Run) -> None:
    with run.connected() as rig:
        assert run.end(signal.SIGINT) == 0
        with pytest.raises(DriverError, match="ended or disconnected"):
            rig.get()
    assert "parked, torque off" in run.words() and "Traceback" not in run.words()
    assert not find_sockets(socket_folder(os.environ, os.getuid()))

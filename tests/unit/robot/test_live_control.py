"""Without a socket the head still runs, and says why nobody can reach it."""

import tempfile
from pathlib import Path

import pytest
from fakes.runs import simulated

from gazerig.robot.net.live_server import LiveServer

pytestmark = pytest.mark.usefixtures("ideal_servos")


def test_without_a_socket_it_says_so(monkeypatch: pytest.MonkeyPatch):
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        (Path(folder) / "gazerig").write_text("in the way")
        made, said = simulated("desk"), list[str]()
        live = LiveServer(made.robot, None, {"rig": "desk", "pid": 1}, said.append)
        live.open()
        live.close()
    (line,) = said
    assert line.startswith("gazerig ctl set and stop cannot find this rig: ")

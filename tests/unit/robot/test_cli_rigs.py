"""The list of the rigs that run: gazerig ctl rigs."""

from ticked_rig import gazerig

from gazerig.drivers.errors import DriverError
from gazerig.robot.cli import ctl
from gazerig.robot.net.client import RobotClient


class Listed(RobotClient):
    """A rig that answers, or one that hangs."""

    def __init__(self, pid: int, hangs: bool) -> None:
        self.pid, self._hangs = pid, hangs

    def status(self) -> dict[str, object]:
        if self._hangs:
            raise DriverError("does not answer")
        return {"name": "left", "pid": self.pid}

    def close(self) -> None:
        pass


def test_one_that_hangs_hides_no_other(monkeypatch):
    monkeypatch.setattr(ctl, "connect_to_all", lambda: [Listed(7, True), Listed(8, False)])
    listed = gazerig("ctl", "rigs")
    assert "process 7: does not answer" in listed and "left  8" in listed

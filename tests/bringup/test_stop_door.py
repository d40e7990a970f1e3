"""gazerig stop reaches a head that is being calibrated, and nothing else does."""

import os
import time
from pathlib import Path

import pytest
from commands_started import PATIENCE_S
from served_rigs import rig_files
from test_cli_calibrate_face import sitting_at

from gazerig.drivers.errors import DriverError
from gazerig.robot.remote.client import RequestRejected, RobotClient

pytestmark = pytest.mark.usefixtures("branched_children")


def goes_on(running: RobotClient) -> None:
    """Resume as soon as the stop has held as long as stops do."""
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return running.resume()
        except RequestRejected as refused:
            assert "holds at least" in str(refused) and time.monotonic() < end_s, refused
            time.sleep(1.2)  # who asks sooner is refused for that


def test_a_head_that_is_steered_over_a_face_can_be_stopped_and_told_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Path(rig_files(tmp_path)["desk"])
    # Both processes look there; a path of its own keeps other rigs that run here out of it.
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with sitting_at(rig, "--no-page") as sitting:
        sitting.reads("1/8 the tip of your nose: 0 mm")
        with RobotClient.connect() as running:
            assert running.pid == sitting.pid
            with pytest.raises((DriverError, ValueError), match="is being calibrated"):
                running.look_at(1.0, 0.0, 0.3)
            with pytest.raises((DriverError, ValueError), match="is being calibrated"):
                running.set("loop.rate_hz", 90.0)
            running.stop("a finger")
            assert running.status()["stopped"] == "a finger"
            sitting.reads(f"stopped by process {os.getpid()}: a finger; torque off")
            goes_on(running)
            assert not running.status()["stopped"]
        sitting.types(b"q")
        assert sitting.ends() == 0, sitting.said
    assert not list(tmp_path.glob("**/*.sock"))

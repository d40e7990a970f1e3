"""A rig of Feetech SCS servos: found, examined, set up, moved, run and let go like any other."""

import json

import pytest
from command_line import invoked
from scs_text import scs_text
from served_rigs import hide_real_ports, served

pytestmark = pytest.mark.usefixtures("simulated_wires")


@pytest.fixture
def rig(tmp_path, monkeypatch):
    hide_real_ports(monkeypatch)
    path = tmp_path / "scs.yaml"
    path.write_text(scs_text(), encoding="utf-8")
    return str(path)


def test_it_is_scanned_for_examined_mended_set_up_jogged_watched_and_run(rig):
    with served(rig) as (given, paths, command):
        code, out, _ = invoked("scan", "--port", paths[""], "--kind", "feetech", "--json")
        servos = json.loads(out)["servos"]
        assert code == 0 and [s["model"] for s in servos[:7]] == ["scs0009"] * 6 + ["scs15"]
        code, out, _ = invoked("doctor", rig, "--port", given)
        assert "Return Delay Time 250" in out and "has no bus watchdog" in out
        code, out, _ = invoked("doctor", rig, "--port", given, "--fix")
        assert "its own position limits" in out
        code, out, _ = invoked("doctor", rig, "--port", given)
        assert code == 0 and "Return Delay Time" not in out and "own position limits" not in out
        command("overload 7", "")
        code, out, _ = invoked("doctor", rig, "--port", given)
        assert code != 0 and "overload" in out
    code, out, err = invoked("setup", rig, "--mock", "--yes", "--joint", "neck_yaw")
    assert code == 0 and "id 1 -> 7" in out + err
    code, out, _ = invoked("monitor", rig, "--mock", "--once")
    assert code == 0 and "left_eye_pan" in out and "0 of 9 unanswered" in out
    code, out, err = invoked("calibrate", rig, "--mock", "--joint", "neck_yaw")
    assert code != 0 and "read its steps with gazerig monitor" in out + err
    code, out, err = invoked("jog", rig, "neck_yaw", "20", "--mock")
    assert code == 0 and "arrived" in out + err
    code, out, err = invoked(
        "run", rig, "--mock", "--fast", "--no-page", "--seconds", "2", "--summary", "-"
    )
    assert code == 0 and "parked, torque off" in out + err
    assert json.loads(out[out.index("{") :])["bus"]["errors"] == {}

"""A rig of Feetech SCS servos: found, examined, set up, moved, run and let go like any other."""

import json
from pathlib import Path

import pytest
from command_line import invoked
from served_rigs import hide_real_ports, served

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.feetech.family import FEETECH, FEETECH_SCS
from gazerig.drivers.feetech.memory_table import FeetechParams
from gazerig.drivers.servo_bus.discovery import count_corrupt, scan_ids
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.robot.guardian.process import releaser
from gazerig.robot.guardian.release_plan import ReleasePlan
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

SHIPPED = Path(__file__).parents[2] / "config" / "rigs" / "feetech.yaml"


def scs_text(neck: str = "scs15") -> str:
    """Write the rig; ``neck``: the model of the neck's servos."""
    eyes, head = SHIPPED.read_text(encoding="utf-8").split("\n  neck_yaw:")
    eyes = eyes.replace("model: sts3215", "model: scs0009")
    text = f"{eyes}\n  neck_yaw:{head.replace('model: sts3215', f'model: {neck}')}"
    text = text.replace("zero_step: 2048", "zero_step: 512").replace("name: feetech", "name: scs")
    return text.replace("  rate_hz: 200", "  rate_hz: 50")


pytestmark = pytest.mark.usefixtures("simulated_wires")


@pytest.fixture
def no_real_ports(monkeypatch):
    hide_real_ports(monkeypatch)


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "scs.yaml"
    path.write_text(scs_text(), encoding="utf-8")
    return str(path)


class Bench:
    """Two SCS servos and an STS one on a line, which only bring-up ever meets."""

    def __init__(self):
        self.now_s = 0.0
        specs = [ServoSpec(1, "scs0009", 511), ServoSpec(2, "scs15", 300), ServoSpec(3, "sts3215")]
        self.chain = build_feetech(specs, lambda: self.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.sleep_until)
        self.port.setBaudRate(1_000_000)

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)


def test_both_series_are_known_by_one_search():
    bench = Bench()
    found, _ = scan_ids(bench.port, FEETECH, 1_000_000)
    assert [(one.id, one.number, one.model) for one in found] == [
        (1, 1284, "scs0009"), (2, 1295, "scs15"), (3, 777, "sts3215"),
    ]  # fmt: skip
    assert count_corrupt(bench.port, FEETECH_SCS, 1) == 0
    bench.chain.faults.command("collide 1")
    assert count_corrupt(bench.port, FEETECH_SCS, 1) >= 2


def test_the_guardian_lets_go_of_servos_without_sync_read():
    bench = Bench()
    for servo_id in (1, 2):
        assert Transactions(bench.port, FEETECH_SCS).write(servo_id, "torque_enable", 1)
    plan = ReleasePlan("feetech", "", (1, 2), FeetechParams(), "feetech scs")
    assert releaser(plan)(bench.port) == ()
    assert [bench.chain[i].read(40, 1)[1] for i in (1, 2)] == [b"\x00", b"\x00"]


def test_a_place_beyond_the_potentiometer_and_a_mixture_of_series_are_refused(tmp_path):
    path = tmp_path / "scs.yaml"
    path.write_text(scs_text().replace("zero_step: 512", "zero_step: 1000"), encoding="utf-8")
    with pytest.raises(ConfigError, match="1023"):
        load_rig(str(path))
    eyes, neck = scs_text(neck="sts3215").split("neck_yaw:", 1)
    neck = neck.replace("zero_step: 512", "zero_step: 2048")
    path.write_text(f"{eyes}neck_yaw:{neck}", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"a sts3215 cannot be on one bus with a scs0009"):
        load_rig(str(path))


@pytest.mark.usefixtures("no_real_ports")
def test_it_is_scanned_for_examined_and_mended(rig):
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


@pytest.mark.usefixtures("no_real_ports")
def test_it_is_set_up_jogged_watched_and_run(rig):
    code, out, err = invoked("setup", rig, "--mock", "--yes", "--joint", "neck_yaw")
    assert code == 0 and "id 1 -> 7" in out + err
    code, out, _ = invoked("monitor", rig, "--mock", "--once")
    assert code == 0 and "left_eye_pan" in out and "0 of 9 unanswered" in out
    code, out, err = invoked("calibrate", rig, "--mock", "--joint", "neck_yaw")
    assert code != 0 and "read its steps with gazerig monitor" in out + err
    code, out, err = invoked("jog", rig, "neck_yaw", "20", "--mock")
    assert code == 0 and "arrived" in out + err
    code, out, err = invoked(
        "run", rig, "--mock", "--fast", "--no-page", "--seconds", "4", "--summary", "-"
    )
    assert code == 0 and "parked, torque off" in out + err
    assert json.loads(out[out.index("{") :])["bus"]["errors"] == {}

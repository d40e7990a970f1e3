"""The bring-up commands as people type them, on served pseudo-terminals like real ports."""

import json
import re
from datetime import datetime

import pytest
from desk import JOINTS
from typer.testing import CliRunner

from gazerig.config.save import copy_shipped, save_rig
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.serial.list_ports import Host, SerialPort
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.cli import bringup_commands as cli_servos
from gazerig.robot.cli import progress as bench
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

SMALL = [ServoSpec(1, "xl330-m077", 2048), ServoSpec(7, "xc330-m288", 2048)]


def gazerig(*words, answers=""):
    """Type a command; gives exit code, standard output and standard error."""
    result = CliRunner().invoke(cli_servos.app, list(words), input=answers)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(autouse=True)
def no_real_ports(monkeypatch, tmp_path):
    host = Host(tmp_path / "latency", tmp_path / "by-id", tmp_path / "processes")
    monkeypatch.setattr(bench, "host", host)
    monkeypatch.setattr(bench, "serial_ports", lambda host: ())


def test_scan_lists_every_servo():
    code, out, err = gazerig("scan", "--mock", "--bauds", "57600,1000000")
    assert code == 0
    rows = re.findall(r"(\d) +[│|] (x[lc]330-m\d+) +[│|] (\d+) +[│|] (\d+) +[│|] Dynamixel", out)
    assert [int(row[0]) for row in rows] == list(range(1, 10))
    assert rows[0][1] == "xl330-m077" and rows[8][1] == "xc330-m288"
    assert {row[3] for row in rows} == {"1000000"}
    assert "9 servos on" in out and "asked dynamixel at 1000000, 57600 bit/s" in out
    assert "feetech was not asked, as others answered" in out


def test_scan_for_programs():
    code, out, _ = gazerig("scan", "--mock", "--bauds", "1000000", "--json")
    found = json.loads(out)
    assert code == 0 and [servo["id"] for servo in found["servos"]] == list(range(1, 10))
    assert found["servos"][6]["model"] == "xc330-m288"


def test_scan_of_a_port_where_nobody_answers():
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=2_000_000)
        code, out, _ = gazerig("scan", "--port", path, "--bauds", "1000000",
                               "--kind", "dynamixel")  # fmt: skip
    assert code == 1 and "nobody answers" in out and "supply" in out


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("scan", "--bauds", "123"), "--bauds 123: not all or some of 9600"),
        (("scan",), "no serial port on USB"),
        (("scan", "--port", "/dev/ttyNONE"), "no serial port /dev/ttyNONE"),
        (("scan", "--mock", "--port", "/dev/x"), "exclude each other"),
        (("scan", "--kind", "servo"), "--kind servo: not all or one of dynamixel, feetech"),
        (("scan", "--kind", "pca9685"), "--kind pca9685: hangs on no serial port"),
        (("scan", "--kind", "feetech", "--bauds", "9600", "--port", "/dev/x"), "none of them is"),
        (("doctor", "dsk"), "nothing named 'dsk'"),
        (("setup", "--joint", "neck"), "--joint neck: unknown; joints are left_eye_pan"),
        (("reboot", "neck"), "neither an id from 0 to 252 nor a joint"),
        (("reboot", "253"), "neither an id from 0 to 252 nor a joint"),
    ],
)
def test_what_is_asked_wrongly(words, says):
    code, _, err = gazerig(*words)
    assert code == 2 and says in err


def test_scan_asks_which_port_where_there_are_several(monkeypatch):
    ports = [SerialPort(f"/dev/ttyACM{i}", "board", "1:2", None) for i in range(2)]
    monkeypatch.setattr(bench, "serial_ports", lambda host: ports)
    code, _, err = gazerig("scan")
    assert code == 2 and "which port?" in err and "/dev/ttyACM1 (board)" in err
    monkeypatch.setattr(bench, "serial_ports", lambda host: ports[:1])
    assert "no serial port /dev/ttyACM0" in gazerig("scan")[2]


def test_doctor_finds_and_fixes():
    code, out, err = gazerig("doctor", "--mock")
    assert code == 0
    assert "waits 500 us before every answer" in out and "(servos 1-9)" in out
    assert " mends " in out
    code, out, err = gazerig("doctor", "--mock", "--fix")
    assert code == 0
    assert "neck_yaw (servo 7): return delay time 250 -> 0: done" in out
    after = out.partition("after that:")[2]
    assert "waits" not in after and "xc330-m288, firmware" in after
    assert "nothing that --fix" in gazerig("doctor", "--port", "/dev/ttyNONE", "--fix")[1]


def test_doctor_on_a_port_served_elsewhere_names_what_is_wrong():
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=1_000_000)
        bus.command("overload 7")
        code, out, _ = gazerig("doctor", "--port", path)
        assert code == 1
        assert "neck_yaw (servo 7): has latched: overload" in out
        assert f"then gazerig reboot desk 7 --port {path}" in out
        assert "does not answer" in out and "neck_pitch" in out
        code, out, _ = gazerig("doctor", "--port", path, "--json")
        found = json.loads(out)
        assert {f["where"] for f in found if f["what"] == "does not answer"} == {
            f"{name} (servo {i})" for i, name in enumerate(JOINTS, 1) if i not in (1, 7)
        }
        code, _, err = gazerig("reboot", "neck_yaw", "--port", path)
        assert code == 0
        assert "neck_yaw (servo 7): latched: overload, torque off" in err
        assert "back after" in err and "nothing latched, torque off" in err


def test_a_port_that_another_program_uses():
    with PtyBus() as bus:
        port = BlockingPort(bus.start(SMALL, baud=1_000_000))
        port.setBaudRate(1_000_000)
        code, out, _ = gazerig("doctor", "--port", port.port_name)
        port.closePort()
        assert code == 1 and f"error {port.port_name}: is busy: close the other program" in out


def test_fresh_servos_all_connected_at_once_are_noticed():
    with PtyBus() as bus:
        path = bus.start([ServoSpec(1, "xl330-m077", 700 * n) for n in range(3)], baud=57_600)
        code, out, _ = gazerig("scan", "--port", path, "--bauds", "57600")
        assert code == 0 and "two or more servos have id 1 at 57600 bit/s" in out


def test_doctor_of_a_port_that_is_not_there():
    code, out, _ = gazerig("doctor", "--port", "/dev/ttyNONE")
    assert code == 1 and "there is no such port" in out


def test_setup_with_flags_alone():
    code, _, err = gazerig(
        "setup", "--mock", "--yes", "--joint", "left_eye_pan", "--joint", "neck_roll"
    )
    assert code == 0
    for n, name, i in ((1, "left_eye_pan", 1), (2, "neck_roll", 9)):
        assert f"{n} of 2: connect the " in err and f"{name} (servo {i})" in err
        assert f"answers as id {i} at 1000000 bit/s" in err
    assert "done: 2 of 2" in err


def test_setup_in_steps_with_answers():
    words = ("setup", "--mock", "--joint", "neck_yaw", "--joint", "neck_roll")
    code, _, err = gazerig(*words, answers="\ny\ns\n")
    assert code == 0
    assert "found: xc330-m288, firmware" in err and "give it id 7 and 1000000 bit/s?" in err
    assert "neck_yaw (servo 7): id 1 -> 7; baud rate 57600 -> 1000000" in err
    assert "skipped: neck_roll" in err and "done: 1 of 2" in err


def test_setup_asks_again_when_the_wrong_servo_is_connected():
    with PtyBus() as bus:
        path = bus.start([ServoSpec(1, "xl330-m077", 2048)], baud=57_600)
        code, _, err = gazerig("setup", "--port", path, "--joint", "neck_yaw", answers="\ns\n")
        assert code == 0 and "this is xl330-m077" in err and "skipped: neck_yaw" in err
        code, _, err = gazerig("setup", "--port", path, "--joint", "neck_yaw", "--yes")
        assert code == 2 and "this is xl330-m077" in err
        code, _, err = gazerig("setup", "--port", path, "--only", "left_eye_pan", "--yes")
        assert code == 0 and "answers as id 1 at 1000000 bit/s" in err


def test_reboot_asks_before_a_joint_goes_limp():
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=1_000_000)
        with_torque = ("reboot", "7", "--port", path)
        switch_on(path)
        code, _, err = gazerig(*with_torque, answers="n\n")
        assert code == 0 and "goes limp" in err and "left as it is" in err
        code, _, err = gazerig(*with_torque, "--yes")
        assert code == 0 and "torque on" in err and "back after" in err
        code, _, err = gazerig("reboot", "9", "--port", path)
        assert code == 2 and "servo 9 does not answer" in err


def switch_on(path):
    port = BlockingPort(path)
    port.setBaudRate(1_000_000)
    assert Registers(port, DYNAMIXEL).write(7, "torque_enable", 1)
    port.closePort()


def test_a_rig_of_ones_own_names_its_port(tmp_path):
    mine = copy_shipped("desk", tmp_path / "mine.yaml")
    with PtyBus() as bus:
        path = bus.start(SMALL[1:], baud=57_600)
        wishes = {"bus.port": path, "bus.dynamixel.baud": 57_600, "joints.neck_yaw.id": 20}
        save_rig(mine, wishes, datetime(2026, 1, 1))
        code, _, err = gazerig("setup", str(mine), "--joint", "neck_yaw", "--yes")
        assert code == 0 and "id 7 -> 20; answers as id 20 at 57600 bit/s" in err

"""scan, doctor, setup and reboot of smart servos as people type them.

Most in simulated time; of each command one is on a pseudo-terminal too, and marked so.
"""

import json
import re
import shlex
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
import typer
from command_line import invoked
from desk import GAZE_JOINTS
from served_rigs import hide_real_ports, rig_files, served
from typer.testing import CliRunner

from gazerig.config.save import copy_shipped, save_rig
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.serial.list_ports import SerialPort
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.cli import ports
from gazerig.robot.cli.main import app
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

pytestmark = pytest.mark.usefixtures("branched_children", "simulated_wires")

SMALL = [ServoSpec(1, "xl330-m077", 2048), ServoSpec(7, "xc330-m288", 2048)]
LINE = {"desk": DynamixelLine, "feetech": FeetechLine}
ROW = r"(\d) +[│|] ([\w-]+) +[│|] ([\d.]+) +[│|] (\d+) +[│|] "


@pytest.fixture(autouse=True)
def no_real_ports(monkeypatch, tmp_path):
    hide_real_ports(monkeypatch, tmp_path)


@pytest.fixture
def mixed(tmp_path):
    """Return the path of a rig with eyes on a Maestro, a Dynamixel and a Feetech neck servo."""
    return rig_files(tmp_path)["mixed"]


# --- scan


def test_scan_lists_every_servo():
    code, out, _ = invoked("scan", "--mock", "--bauds", "57600,1000000")
    assert code == 0
    rows = re.findall(ROW + "Dynamixel", out)
    assert [int(row[0]) for row in rows] == list(range(1, 10))
    assert rows[0][1] == "xl330-m077" and rows[8][1] == "xc330-m288"
    assert {row[3] for row in rows} == {"1000000"}
    assert "9 servos on" in out and "searched dynamixel at 1000000, 57600 bit/s" in out
    assert "feetech was not searched, as others answered" in out
    code, out, _ = invoked("scan", "--mock", "--bauds", "1000000", "--json")
    found = json.loads(out)
    assert code == 0 and [servo["id"] for servo in found["servos"]] == list(range(1, 10))
    assert found["servos"][6]["model"] == "xc330-m288"


def test_scan_of_feetech_servos():
    with PtyBus() as bus:
        path = bus.start_device(FeetechLine((ServoSpec(1, "sts3215"), ServoSpec(9, "sts3215"))))
        words = ("scan", "--port", path, "--bauds", "1000000")
        code, out, _ = invoked(*words)
        rows = [("1", "sts3215", "3.53", "1000000"), ("9", "sts3215", "3.53", "1000000")]
        assert code == 0 and re.findall(ROW + "Feetech", out) == rows
        code, out, _ = invoked(*words, "--kind", "dynamixel")
        assert code == 1 and "gazerig scan --kind feetech" in out


def test_scan_of_every_bus_of_a_rig(mixed):
    code, out, _ = invoked("scan", mixed, "--mock", "--bauds", "1000000", "--json")
    reported = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and [len(one["boards"]) for one in reported] == [1, 0, 0]
    found = [(s["kind"], s["id"]) for one in reported for s in one["servos"]]
    assert found == [("dynamixel", 7), ("feetech", 1)]


def test_scan_of_a_port_where_nobody_answers():
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=2_000_000)
        words = ("--port", path, "--bauds", "1000000", "--kind", "dynamixel")
        code, out, _ = invoked("scan", *words)
    assert code == 1 and "no servo answers" in out and "supply" in out


@pytest.mark.pty
def test_fresh_servos_all_connected_at_once_are_noticed():
    with PtyBus() as bus:
        path = bus.start([ServoSpec(1, "xl330-m077", 700 * n) for n in range(3)], baud=57_600)
        code, out, _ = invoked("scan", "--port", path, "--bauds", "57600")
        assert code == 0 and "two or more servos have id 1 at 57600 bit/s" in out


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
    code, _, err = invoked(*words)
    assert code == 2 and says in err


def test_scan_asks_which_port_where_there_are_several(monkeypatch):
    two = [SerialPort(f"/dev/ttyACM{i}", "board", "1:2", None) for i in range(2)]
    monkeypatch.setattr(ports, "serial_ports", lambda host: two)
    code, _, err = invoked("scan")
    assert code == 2 and "which port?" in err and "/dev/ttyACM1 (board)" in err
    monkeypatch.setattr(ports, "serial_ports", lambda host: two[:1])
    assert "no serial port /dev/ttyACM0" in invoked("scan").err


# --- doctor


@pytest.mark.pty
def test_doctor_finds_and_fixes():
    code, out, _ = invoked("doctor", "--mock")
    assert code == 0
    assert "waits 500 us before every answer" in out and "(servos 1-9)" in out
    assert " mends " in out
    code, out, _ = invoked("doctor", "--mock", "--fix")
    assert code == 0
    assert "neck_yaw (servo 7): return delay time 250 -> 0: done" in out
    after = out.partition("after that:")[2]
    assert "waits" not in after and "xc330-m288, firmware" in after
    assert "nothing that --fix" in invoked("doctor", "--port", "/dev/ttyNONE", "--fix").out


@pytest.mark.parametrize("rig", ["maker", "feetech"])
def test_doctor_of_the_shipped_rigs(rig):
    code, out, _ = invoked("doctor", rig, "--mock", "--fix")
    assert code == 0
    after = out.partition("after that:")[2]
    assert "error" not in after and "warn" not in after.replace("0 warn", "")


def test_doctor_on_a_port_served_elsewhere_names_what_is_wrong():
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=1_000_000)
        bus.command("overload 7")
        code, out, _ = invoked("doctor", "--port", path)
        assert code == 1
        assert "neck_yaw (servo 7): has latched: overload" in out
        assert f"then gazerig reboot desk 7 --port {path}" in out
        assert "does not answer" in out and "neck_pitch" in out
        code, out, _ = invoked("doctor", "--port", path, "--json")
        found = json.loads(out)
        assert {f["where"] for f in found if f["what"] == "does not answer"} == {
            f"{name} (servo {i})" for i, name in enumerate(GAZE_JOINTS, 1) if i not in (1, 7)
        }


def test_doctor_examines_every_bus_and_says_which(mixed):
    with served(mixed) as (ports, paths, command):
        command("error protocol")
        command("script on")
        command("overload 7", "neck")
        command("voltage 1 12.0", "tilt")
        code, out, _ = invoked("doctor", mixed, "--port", ports)
        assert code == 1
        main, neck, tilt = re.split(r"^bus \w+ \(.*\):$", out, flags=re.MULTILINE)
        assert f"bus neck (dynamixel, {paths['neck']}):" in out
        assert f"the main bus (maestro, {paths['']}):" in main
        assert "serial protocol error" in main and "runs a script" in main
        assert "neck_yaw (servo 7): has latched: overload" in neck
        assert "neck_pitch (servo 1): 12.0 V, its limits are" in tilt and "sts3215-12v" in tilt
        code, out, _ = invoked("doctor", mixed, "--port", ports, "--json", "--fix")
        found = json.loads(out)
        assert {one["bus"] for one in found} == {"", "neck", "tilt"}
        assert not any("script" in one["what"] and one["level"] == "warn" for one in found)


def test_doctor_of_a_bus_that_is_not_there_still_examines_the_others(mixed):
    with served(mixed) as (_, paths, _command):
        given = f"{paths['']},neck=/dev/ttyNONE,tilt={paths['tilt']}"
        code, out, _ = invoked("doctor", mixed, "--port", given)
        assert code == 1 and "there is no such port" in out
        assert "neck_pitch (servo 1)" in out and "pulses on 0 of 6 channels" in out
    code, out, _ = invoked("doctor", "--port", "/dev/ttyNONE")
    assert code == 1 and "there is no such port" in out


@pytest.mark.pty
def test_a_port_that_another_program_uses():
    with PtyBus() as bus:
        port = BlockingPort(bus.start(SMALL, baud=1_000_000))
        port.setBaudRate(1_000_000)
        code, out, _ = invoked("doctor", "--port", port.port_name)
        port.closePort()
        assert code == 1 and f"error {port.port_name}: is busy: close the other program" in out


# --- setup


@pytest.mark.pty
def test_setup_with_flags_alone():
    code, _, err = invoked(
        "setup", "--mock", "--yes", "--joint", "left_eye_pan", "--joint", "neck_roll"
    )
    assert code == 0
    for n, name, i in ((1, "left_eye_pan", 1), (2, "neck_roll", 9)):
        assert f"{n} of 2: connect the " in err and f"{name} (servo {i})" in err
        assert f"answers as id {i} at 1000000 bit/s" in err
    assert "done: 2 of 2" in err


@pytest.mark.parametrize(
    ("rig", "found", "done"),
    [
        ("desk", "xc330-m288, firmware", "id 1 -> 7; baud rate 57600 -> 1000000"),
        ("feetech", "sts3215, firmware 3.53, id 1 at 1000000 bit/s", "id 1 -> 7; answers as id 7"),
    ],
)
def test_setup_in_steps_with_answers(rig, found, done):
    words = ("setup", rig, "--mock", "--joint", "neck_yaw", "--joint", "neck_roll")
    code, _, err = invoked(*words, answers="\ny\ns\n")
    assert code == 0
    assert f"found: {found}" in err and "give it id 7 and 1000000 bit/s?" in err
    assert f"neck_yaw (servo 7): {done}" in err
    assert "skipped: neck_roll" in err and "done: 1 of 2" in err


def test_setup_asks_again_when_the_wrong_servo_is_connected():
    with PtyBus() as bus:
        path = bus.start([ServoSpec(1, "xl330-m077", 2048)], baud=57_600)
        words = ("setup", "--port", path, "--joint", "neck_yaw")
        code, _, err = invoked(*words, answers="\ns\n")
        assert code == 0 and "this is xl330-m077" in err and "skipped: neck_yaw" in err
        code, _, err = invoked(*words, "--yes")
        assert code == 2 and "this is xl330-m077" in err
        code, _, err = invoked("setup", "--port", path, "--only", "left_eye_pan", "--yes")
        assert code == 0 and "answers as id 1 at 1000000 bit/s" in err


def test_setup_finds_a_feetech_servo_anywhere_and_refuses_two():
    with PtyBus() as bus:
        path = bus.start_device(FeetechLine((ServoSpec(77, "sts3215"),), 115_200))
        words = ("setup", "feetech", "--port", path, "--joint", "neck_yaw", "--yes")
        code, _, err = invoked(*words)
        assert code == 0 and "id 77 at 115200 bit/s" in err
        assert "id 77 -> 7; baud rate 115200 -> 1000000 bit/s; answers as id 7" in err
        bus.command("collide 7")
        code, _, err = invoked(*words)
        assert code == 2 and "connect one servo alone" in err


def test_setup_goes_through_all_buses(mixed):
    code, _, err = invoked(
        "setup", mixed, "--mock", "--yes", "--joint", "neck_yaw", "--joint", "neck_pitch",
        "--joint", "eyes_pan",
    )  # fmt: skip
    assert code == 0 and "the main bus: a Pololu Maestro; 1 of its channels to try" in err
    assert ", bus neck: 1 of 8 servos to set up for 1000000" in err
    assert "neck_yaw (servo 7): id 1 -> 7" in err
    assert "neck_pitch (servo 1): nothing to change" in err and "done: 3 of 3" in err


def test_a_rig_of_ones_own_names_its_port(tmp_path):
    mine = copy_shipped("desk", tmp_path / "mine.yaml")
    with PtyBus() as bus:
        path = bus.start(SMALL[1:], baud=57_600)
        wishes: dict[str, Any] = {"bus.port": path, "bus.dynamixel.baud": 57_600}
        wishes["joints.neck_yaw.id"] = 20
        save_rig(mine, wishes, datetime(2026, 1, 1))
        code, _, err = invoked("setup", str(mine), "--joint", "neck_yaw", "--yes")
        assert code == 0 and "id 7 -> 20; answers as id 20 at 57600 bit/s" in err


# --- reboot


@pytest.mark.parametrize(
    ("rig", "before", "after"),
    [
        ("desk", "latched: overload, torque off", "nothing latched, torque off"),
        ("feetech", "reports: overload", "no errors, torque off"),
    ],
)
def test_reboot_clears_an_error(rig, before, after):
    with PtyBus() as bus:
        model = {"desk": "xc330-m288", "feetech": "sts3215"}[rig]
        path = bus.start_device(LINE[rig]((ServoSpec(7, model),), 1_000_000))  # type: ignore[arg-type]
        bus.command("overload 7")
        code, _, err = invoked("reboot", rig, "neck_yaw", "--port", path)
    assert code == 0 and f"neck_yaw (servo 7): {before}" in err
    assert "back after" in err and after in err


@pytest.mark.pty
def test_reboot_asks_before_the_torque_goes_off():
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=1_000_000)
        port = BlockingPort(path)
        port.setBaudRate(1_000_000)
        assert Registers(port, DYNAMIXEL).write(7, "torque_enable", 1)
        port.closePort()
        code, _, err = invoked("reboot", "7", "--port", path, answers="n\n")
        assert code == 0 and "torque goes off" in err and "left as it is" in err
        code, _, err = invoked("reboot", "7", "--port", path, "--yes")
        assert code == 0 and "torque on" in err and "back after" in err
        code, _, err = invoked("reboot", "9", "--port", path)
        assert code == 2 and "servo 9 does not answer" in err


def test_reboot_by_a_number_needs_one_bus_that_has_it(mixed):
    code, _, err = invoked("reboot", mixed, "1", "--mock")
    assert code == 2 and "1: which bus (the main bus, bus tilt)? name the joint instead" in err
    code, _, err = invoked("reboot", mixed, "7", "--mock")
    assert code == 0 and "neck_yaw (servo 7): back after" in err


# --- every remedy that the doctor suggests can be typed and reaches the same rig and port

DESK = Path(__file__).parents[2] / "config/rigs/desk.yaml"


def commands_in(text: str) -> list[list[str]]:
    """Return every command of the family that reaches servos, as it would be typed."""
    token = r"(?: (?:--[a-z]+|'[^']+'|/\S*[\w]|\w+\.yaml|\d+\b|(?<=--joint )\w+|desk\b))*"
    found = re.findall(rf"gazerig (?:doctor|setup|reboot|calibrate|scan|home)\b{token}", text)
    return [shlex.split(one)[1:] for one in found if one != "gazerig reboot"]


def parsed(words: list[str]) -> dict[str, object]:
    """Parse a command as the command line does, without running it."""
    group = typer.main.get_command(app)
    context = group.make_context("gazerig", list(words), resilient_parsing=False)
    name, command, rest = group.resolve_command(context, list(words))  # type: ignore[attr-defined]
    with command.make_context(name, rest, parent=context) as made:
        return dict(made.params)


@pytest.mark.parametrize("fault", ["overload 7", "stick 7"])
@pytest.mark.parametrize("asked", [["doctor"], ["doctor", "--fix"], ["doctor", "--json"]])
def test_every_cure_of_the_doctor_can_be_typed(
    fault: str, asked: list[str], tmp_path, capfd
) -> None:
    rig = tmp_path / "mine.yaml"
    rig.write_text(DESK.read_text())
    with PtyBus() as bus:
        path = bus.start(SMALL, baud=1_000_000)
        bus.command(fault)
        made = CliRunner().invoke(app, [*asked, str(rig), "--port", path])
    said = made.output
    found = commands_in(said)
    assert found
    for words in found:
        values = parsed(words)
        assert values["port"] == path, words
        if "rig" in values and words[0] != "scan":
            assert values["rig"] == str(rig), words

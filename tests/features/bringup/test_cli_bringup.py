"""scan, doctor, setup, jog and monitor as people type them."""

import json
import re
import signal
import time
from pathlib import Path

import pytest
from command_line import Invoked, answers_in, invoked
from commands_started import hear, start, status
from fakes.pty_bus import PtyBus
from served_rigs import served

from gazerig.config.schema import load_rig
from gazerig.drivers.serial.list_ports import SerialPort
from gazerig.features.bringup.cli import ports
from gazerig.features.bringup.cli.calibrate import camera
from gazerig.features.bringup.manual_control import ManualControl
from gazerig.robot.model.clock import SimulatedClock
from gazerig.sim_mock.devices import MaestroLine

pytestmark = pytest.mark.usefixtures("simulated_wires", "no_real_ports")
ROW = r"(\d) +[│|] ([\w-]+) +[│|] ([\d.]+) +[│|] (\d+) +[│|] "


# --- scan


def test_scan_lists_every_servo():
    code, out, _ = invoked("scan", "--mock", "--kind", "dynamixel")
    assert code == 0
    rows = re.findall(ROW + "Dynamixel", out)
    assert [int(row[0]) for row in rows] == list(range(1, 10))
    assert rows[0][1] == "xl330-m077" and rows[8][1] == "xc330-m288"
    assert {row[3] for row in rows} == {"1000000"}
    assert "9 servos on" in out and "searched dynamixel at 1000000, 57600, " in out


# --- doctor


def test_doctor_finds_and_fixes():
    code, out, _ = invoked("doctor", "--mock")
    assert code == 0
    assert "waits 500 us before every answer" in out and "(servos 1, 2, 3, 4, 5, 6, 7, 8, 9)" in out
    assert " mends " in out
    code, out, _ = invoked("doctor", "--mock", "--fix")
    assert code == 0
    assert "neck_yaw (servo 7): return delay time 250 -> 0: done" in out
    after = out.partition("after that:")[2]
    assert "waits" not in after and "xc330-m288, firmware" in after
    assert "nothing that --fix" in invoked("doctor", "--port", "/dev/ttyNONE", "--fix").out


def test_doctor_examines_every_bus_and_says_which(rigs):
    mixed = rigs["mixed"]
    with served(mixed) as (ports, paths, command):
        command("error 4")
        command("overload 7", "neck")
        command("voltage 1 12.0", "tilt")
        code, out, _ = invoked("doctor", mixed, "--port", ports)
        assert code == 1
        main, neck, tilt = re.split(r"^bus \w+ \(.*\):$", out, flags=re.MULTILINE)
        assert f"bus neck (dynamixel, {paths['neck']}):" in out
        assert f"the main bus (maestro, {paths['']}):" in main
        assert "serial protocol error" in main
        assert "neck_yaw (servo 7): has latched: overload" in neck
        assert "neck_pitch (servo 1): 12.0 V, its limits are" in tilt and "sts3215-12v" in tilt
        code, out, _ = invoked("doctor", mixed, "--port", ports, "--json", "--fix")
        found = json.loads(out)
        assert {one["bus"] for one in found} == {"", "neck", "tilt"}


# --- setup


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


# --- jog and monitor as they are typed, on rigs of every kind


@pytest.mark.pty
def test_sigterm_while_jogging_parks_and_lets_go():
    with served("desk") as desk:
        process = start("jog", "desk", "neck_yaw", "60", "--speed", "40", "--port", desk.ports)
        hear(process.stderr, "torque on")
        time.sleep(0.3)
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=30)
        assert process.returncode == 1 and "SIGTERM" in words
        # A starved machine has no time left for the motion.
        assert re.search(r"parked( \(not there in time\))?, torque off on all servos", words)
        assert not any(status(desk.command, servo_id)["torque"] for servo_id in range(1, 10))


def test_a_servo_that_does_not_confirm_its_torque_off_is_named(monkeypatch):
    stop = ManualControl.stop

    def unconfirmed(self: ManualControl) -> tuple[str, ...]:
        return *stop(self), "neck_roll (servo 9): torque-off not confirmed: cut the servo power"

    monkeypatch.setattr(ManualControl, "stop", unconfirmed)
    done = invoked("jog", "desk", "left_eye_pan", "-2", "--mock", "--seconds", "0", "--no-park")
    assert done.code == 1
    assert "torque off on all servos; neck_roll (servo 9): torque-off not confirmed" in done.err


@pytest.mark.parametrize(
    ("joint", "angle", "says"),
    [
        ("nose", "3", "no joint 'nose'; available: left_eye_pan"),
        ("neck_yaw", "nan", "not an angle"),
        ("left_eye_pan", "50", "50.0 deg is outside its range, -35..35 deg"),
    ],
)
def test_nonsense_is_refused_before_the_torque_is_on(joint, angle, says):
    done = invoked("jog", "desk", joint, angle, "--mock")
    assert done.code == 2 and says in done.err and "torque on" not in done.err


# --- hobby servos and rigs of several kinds


def test_on_real_wires_hobby_servos_are_asked_for_first(rigs):
    rig = rigs["mixed"]
    with served(rig) as buses:
        refused = invoked("jog", rig, "neck_yaw", "5", "--port", buses.ports)
        assert refused.code == 2 and "say --yes" in refused.err
        assert "torque on" not in refused.err
        assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])
        words = ("--port", buses.ports, "--yes", "--speed", "60", "--seconds", "0")
        done = invoked("jog", rig, "eyes_pan", "8", *words)
        assert done.code == 0, done.err
        assert "go to their parking place at once" in done.err
        assert "torque on: 2 servos hold where they are, 6 hobby servos" in done.err
        assert re.search(r"eyes_pan: desired 8\.0, estimated \d\.\d deg", done.err)
        assert re.search(r"parked( \(.*\))?, torque off on all servos", done.err)
        assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])


# --- scan and setup of boards that move hobby servos


def test_servo_packets_are_never_sent_to_a_board_of_pololu(monkeypatch):
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(crc=True))
        board = SerialPort(path, "Pololu Mini Maestro", "1ffb:008a", None)
        monkeypatch.setattr(ports, "serial_ports", lambda: (board,))
        for words in (
            ("scan", "--port", path, "--kind", "feetech"),
            ("scan", "--port", path, "--kind", "dynamixel"),
            ("setup", "--port", path, "--joint", "neck_yaw", "--yes"),
            ("doctor", "--port", path),
        ):
            code, _, err = invoked(*words)
            assert code == 2 and "board of Pololu" in err and "would move" in err, words
        code, out, _ = invoked("scan", "--port", path)
        told = f"Pololu Maestro: 12 channels, CRC on\n{path}: pulses: none (channels 0..5)\n"
        assert code == 0 and told in out
        bus.command("lose all")
        code, out, _ = invoked("scan", "--port", path)
        assert code == 1 and "no servo answers" in out
        bus.command("clear")
        done = invoked("doctor", "maker", "--port", path)
        # Any packet of theirs would have been an error to it.
        assert done.code == 0 and "held an error" not in done.out


# --- gazerig calibrate joints, camera, board and face as they are typed, against emulated buses


def calibrated(*words: str) -> Invoked:
    """Run a calibration that succeeds."""
    done = invoked("calibrate", *words)
    assert done.code == 0, done.err
    return done


# --- joints


def test_by_hand_a_joint_is_written_into_the_rig_with_a_backup(rig, tmp_path):
    before = rig.read_text("utf-8")
    answers = answers_in(tmp_path, "turn -400", "", "turn 700", "", "turn -290", "", "y")
    done = calibrated(str(rig), "--mock", "--joint", "left_eye_pan", "--answers", answers)
    found = load_rig(str(rig)).joints["left_eye_pan"]
    # The emulated stops are at 1604 and 2492, the hand starts at 2116.
    assert found.sign == -1 and found.zero_step == pytest.approx(2126, abs=12)
    assert found.min_deg < -20.0 < 20.0 < found.max_deg
    (backup,) = tmp_path.glob("desk.yaml.bak-*")
    assert backup.read_text("utf-8") == before
    assert "# The desk rig" in rig.read_text("utf-8")
    assert "joints.left_eye_pan.sign: 1 -> -1" in done.err
    assert "left_eye_pan (servo 1): torque off" in done.err
    assert "joints.left_eye_pan.zero_step" in done.err


def test_a_lens_is_measured_and_written(rig, monkeypatch):
    monkeypatch.setattr(camera, "RealClock", SimulatedClock)
    done = calibrated("camera", str(rig), "--mock", "--what", "lens", "--yes")
    lens = load_rig(str(rig)).camera.lens
    assert lens is not None
    assert lens.focal_px == pytest.approx((480.0, 482.0), rel=0.01)  # BOARD_LENS
    assert lens.centre_px == pytest.approx((327.0, 190.0), abs=6.4)
    assert "lens: 13 views, 0 dropped, reprojection error 0.1" in done.err


# --- on a port that another program serves, from a process of its own


@pytest.mark.pty
def test_ctrl_c_while_calibrating_lets_go_and_writes_nothing(rigs):
    rig = Path(rigs["maker"])
    before = rig.read_bytes()
    with served(str(rig)) as buses:
        words = ("--joint", "eyes_pan", "--yes", "--port", buses.ports)
        process = start("calibrate", str(rig), *words)
        assert process.stdin is not None
        hear(process.stderr, "shall it begin?")
        process.stdin.write("\n")
        process.stdin.flush()
        hear(process.stderr, "held at 1500 us")
        assert json.loads(buses.command("status"))["servos"][0]["target"]
        process.send_signal(signal.SIGINT)
        hear(process.stderr, "stopped by SIGINT: nothing written")
        process.communicate(timeout=20)
        assert process.returncode == 1
        assert all(one["target"] == 0 for one in json.loads(buses.command("status"))["servos"])
        assert rig.read_bytes() == before

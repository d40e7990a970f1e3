"""scan, doctor, setup and reboot as typed, on hobby and STS servos and rigs of several buses."""

import contextlib
import json
import re
from pathlib import Path

import board_rig
import pytest
from mixed_rig import mixed_text
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.drivers.serial.list_ports import Host, SerialPort
from gazerig.drivers.serial.port import BlockingPort
from gazerig.robot.app.emulation import emulated_lines
from gazerig.robot.cli import bringup_commands as cli_servos
from gazerig.robot.cli import progress as bench
from gazerig.sim_mock.devices import FeetechLine, MaestroLine
from gazerig.sim_mock.pty.client import PtyBus, PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec


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


@pytest.fixture
def mixed(tmp_path):
    """Return the path of a rig with eyes on a Maestro, a Dynamixel and a Feetech neck servo."""
    path = tmp_path / "mixed.yaml"
    path.write_text(mixed_text(), encoding="utf-8")
    return str(path)


@contextlib.contextmanager
def served(rig):
    """Serve a rig's buses; gives what --port wants, their paths, and what lets things happen."""
    with PtyBuses() as buses:
        paths = buses.start(emulated_lines(load_rig(rig)))
        given = ",".join(f"{name}={path}" if name else path for name, path in paths.items())
        yield given, paths, buses.command


# --- scan


def test_scan_of_a_maestro():
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine())
        bus.command("error signal")
        bus.command("script on")
        code, out, _ = gazerig("scan", "--port", path)
        assert code == 0 and "Pololu Maestro: 6 channels or more" in out
        assert "serial signal error" in out and "its own script runs" in out
        assert "nothing else was sent" in out and "asked dynamixel" not in out
        code, out, _ = gazerig("scan", "--port", path, "--json", "--kind", "maestro")
        (board,) = json.loads(out)["boards"]
        assert code == 0 and board["script"] is True and board["errors"] == []


def test_scan_of_feetech_servos():
    with PtyBus() as bus:
        path = bus.start_device(FeetechLine((ServoSpec(1, "sts3215"), ServoSpec(9, "sts3215"))))
        code, out, _ = gazerig("scan", "--port", path, "--bauds", "1000000")
        rows = re.findall(r"(\d) +[│|] sts3215 +[│|] (\d+\.\d+) +[│|] (\d+) +[│|] Feetech", out)
        assert code == 0 and rows == [("1", "3.53", "1000000"), ("9", "3.53", "1000000")]
        code, out, _ = gazerig("scan", "--port", path, "--bauds", "1000000", "--kind", "dynamixel")
        assert code == 1 and "gazerig scan --kind feetech" in out


def test_scan_of_every_bus_of_a_rig(mixed):
    code, out, _ = gazerig("scan", mixed, "--mock", "--bauds", "1000000", "--json")
    told = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and len(told) == 3
    assert len(told[0]["boards"]) == 1
    assert [(s["kind"], s["id"]) for one in told for s in one["servos"]] == [
        ("dynamixel", 7), ("feetech", 1),
    ]  # fmt: skip


def test_servo_packets_are_never_sent_to_a_board_of_pololu(monkeypatch):
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(crc=True))
        board = SerialPort(path, "Pololu Mini Maestro", "1ffb:008a", None)
        monkeypatch.setattr(bench, "serial_ports", lambda host: (board,))
        monkeypatch.setattr("gazerig.robot.cli.ports.serial_ports", lambda: (board,))
        for words in (
            ("scan", "--port", path, "--kind", "feetech"),
            ("scan", "--port", path, "--kind", "dynamixel"),
            ("setup", "--port", path, "--joint", "neck_yaw", "--yes"),
            ("setup", "feetech", "--port", path, "--joint", "neck_yaw", "--yes"),
            ("reboot", "neck_yaw", "--port", path),
            ("doctor", "--port", path),
        ):
            code, _, err = gazerig(*words)
            assert code == 2 and "board of Pololu" in err and "would move" in err, words
        # Any packet of theirs would have been an error to it.
        assert json.loads(bus.command("status"))["errors"] == []
        code, out, _ = gazerig("scan", "--port", path)
        assert code == 0 and "12 channels" in out
        assert gazerig("doctor", "maker", "--port", path)[0] == 0


# --- doctor


@pytest.mark.parametrize("rig", ["maker", "feetech"])
def test_doctor_of_the_shipped_rigs(rig):
    code, out, _ = gazerig("doctor", rig, "--mock", "--fix")
    assert code == 0
    after = out.partition("after that:")[2]
    assert "error" not in after and "warn" not in after.replace("0 warn", "")


def test_doctor_examines_every_bus_and_says_which(mixed):
    with served(mixed) as (ports, paths, command):
        command("error protocol")
        command("script on")
        command("overload 7", "neck")
        command("voltage 1 12.0", "tilt")
        code, out, _ = gazerig("doctor", mixed, "--port", ports)
        assert code == 1
        main, neck, tilt = re.split(r"^bus \w+ \(.*\):$", out, flags=re.MULTILINE)
        assert f"bus neck (dynamixel, {paths['neck']}):" in out
        assert f"the main bus (maestro, {paths['']}):" in main
        assert "serial protocol error" in main and "runs a script" in main
        assert "neck_yaw (servo 7): has latched: overload" in neck
        assert "neck_pitch (servo 1): 12.0 V, its limits are" in tilt and "sts3215-12v" in tilt
        code, out, _ = gazerig("doctor", mixed, "--port", ports, "--json", "--fix")
        found = json.loads(out)
        assert {one["bus"] for one in found} == {"", "neck", "tilt"}
        assert not any("script" in one["what"] and one["level"] == "warn" for one in found)


def test_doctor_of_a_bus_that_is_not_there_still_examines_the_others(mixed):
    with served(mixed) as (_, paths, _command):
        given = f"{paths['']},neck=/dev/ttyNONE,tilt={paths['tilt']}"
        code, out, _ = gazerig("doctor", mixed, "--port", given)
        assert code == 1 and "there is no such port" in out
        assert "neck_pitch (servo 1)" in out and "pulses on 0 of 6 channels" in out


# --- setup


def test_setup_of_a_feetech_servo_with_answers():
    code, _, err = gazerig(
        "setup", "feetech", "--mock", "--joint", "neck_yaw", "--joint", "neck_roll",
        answers="\ny\ns\n",
    )  # fmt: skip
    assert code == 0 and "found: sts3215, firmware 3.53, id 1 at 1000000 bit/s" in err
    assert "neck_yaw (servo 7): id 1 -> 7; answers as id 7 at 1000000 bit/s" in err
    assert "skipped: neck_roll" in err and "done: 1 of 2" in err


def test_setup_finds_a_feetech_servo_anywhere_and_refuses_two():
    with PtyBus() as bus:
        path = bus.start_device(FeetechLine((ServoSpec(77, "sts3215"),), 115_200))
        words = ("setup", "feetech", "--port", path, "--joint", "neck_yaw", "--yes")
        code, _, err = gazerig(*words)
        assert code == 0 and "id 77 at 115200 bit/s" in err
        assert "id 77 -> 7; baud rate 115200 -> 1000000 bit/s; answers as id 7" in err
        bus.command("collide 7")
        code, _, err = gazerig(*words)
        assert code == 2 and "connect one servo alone" in err


def test_setup_of_a_maestro_moves_one_channel_after_another_with_a_yes():
    answers = "\ny\n\ny\ny\nn\n"
    code, _, err = gazerig(
        "setup", "maker", "--mock", "--joint", "eyes_pan", "--joint", "left_upper_lid",
        answers=answers,
    )  # fmt: skip
    assert code == 0 and "channel  0: Min 1088, Max 1936, Speed" in err
    assert "nothing of this can be set over the serial line" in err
    assert "all 2 channels reach both ends" in err
    assert "it goes to 1500 us at once" in err and "did the eyes pan move" in err
    assert "skipped: left_upper_lid" in err and "done: 1 of 2" in err


def test_setup_of_a_maestro_finds_a_range_that_cuts_and_a_servo_on_another_channel():
    with served("maker") as (port, _, command):
        command("set max-us 1900")
        command("script 0")
        code, _, err = gazerig(
            "setup", "maker", "--port", port, "--joint", "eyes_pan",
            # set; supply off; on again; move; it was another; move; that is it
            answers="\ny\n\ny\nn\ny\ny\n",
        )  # fmt: skip
        assert code == 0 and "ran a script of its own: stopped" in err
        assert "and the board stays at 1900 us: set its Min to 1088 and its Max to 1936" in err
        assert "plug its servo into channel 0" in err and "done: 1 of 1" in err
        first = json.loads(command("status"))["servos"][0]
        assert first["position"] == 0


def test_setup_of_a_maestro_with_yes_does_not_guess_about_the_supply():
    code, _, err = gazerig("setup", "maker", "--mock", "--yes", "--joint", "eyes_tilt")
    assert code == 0 and "--yes cannot know that the supply is off" in err and "done: 1 of 1" in err


def test_setup_of_a_maestro_that_does_not_answer():
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(), choices={"mode": "mute"})
        code, _, err = gazerig("setup", "maker", "--port", path, "--yes", "--joint", "eyes_pan")
        assert code == 2 and "no Maestro answers: on USB take the first of its two ports" in err


def test_setup_of_a_board_that_is_too_small(monkeypatch):
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(6, crc=True))
        board = SerialPort(path, "Pololu Micro Maestro", "1ffb:0089", None)
        monkeypatch.setattr(bench, "serial_ports", lambda host: (board,))
        code, _, err = gazerig("setup", "maker", "--port", path, "--yes", "--joint", "eyes_pan")
        assert code == 0 and "USB Dual Port" in err
        monkeypatch.setattr("gazerig.robot.cli.setup_maestro.USB_CHANNELS", {"1ffb:0089": 2})
        code, _, err = gazerig("setup", "maker", "--port", path, "--yes")
        assert code == 2 and "has channels 0..1, not those of left_upper_lid (channel 2)" in err


@pytest.fixture
def on_pca9685(tmp_path):
    """Return the path of the maker's rig with a PCA9685 in place of its Maestro."""
    return board_rig.on_pca9685(tmp_path)


def test_setup_of_a_pca9685_measures_its_clock_and_moves_one_channel_after_another(on_pca9685):
    with served(on_pca9685) as (port, _, command):
        command("set oscillator-mhz 25.44")
        code, _, err = gazerig(
            "setup", on_pca9685, "--port", port, "--joint", "eyes_pan", "--joint", "left_upper_lid",
            # what the meter shows, at last; write it; move; another moved; move; that is it; skip
            answers="about 50\n5.09 Hz\n50.9 hz\ny\ny\nn\ny\ny\nn\n",
        )  # fmt: skip
        assert code == 0 and "eyes_pan: channel 0 of board 0x40" in err
        assert "channel 15, where no joint is, gives 1500 us at 50 Hz" in err
        assert "'about 50': type the frequency or the pulse" in err
        assert "would be a clock of 2.54 MHz" in err and "about 50.0 Hz" in err
        assert "its clock has 25.435 MHz: pulses were 1.7 % too short" in err
        assert "plug its servo into channel 0" in err and "skipped: left_upper_lid" in err
        status = json.loads(command("status"))["servos"]
        assert not any(one["target"] for one in status)
        assert abs(status[0]["place"] - 6000) < 80 and status[2]["place"] == 5920
    text = Path(on_pca9685).read_text(encoding="utf-8")
    assert "# mine" in text and load_rig(on_pca9685).bus.pca9685.oscillator_hz == 25_435_000


def test_setup_of_a_pca9685_with_yes_measures_nothing(on_pca9685):
    code, _, err = gazerig("setup", on_pca9685, "--mock", "--yes", "--joint", "eyes_pan")
    assert code == 0 and "--yes has no meter" in err and "done: 1 of 1" in err


def test_setup_goes_through_all_buses(mixed):
    code, _, err = gazerig(
        "setup", mixed, "--mock", "--yes", "--joint", "neck_yaw", "--joint", "neck_pitch",
        "--joint", "eyes_pan",
    )  # fmt: skip
    assert code == 0 and "the main bus: a Pololu Maestro; 1 of its channels to try" in err
    assert ", bus neck: 1 of 8 servos to set up for 1000000" in err
    assert "neck_yaw (servo 7): id 1 -> 7" in err
    assert "neck_pitch (servo 1): nothing to change" in err and "done: 3 of 3" in err


# --- reboot


def test_reboot_of_a_feetech_servo():
    with served("feetech") as (port, paths, command):
        command("overload 7")
        code, _, err = gazerig("reboot", "feetech", "neck_yaw", "--port", port)
        assert code == 0 and "neck_yaw (servo 7): reports: overload" in err
        assert "back after" in err and "no errors, torque off" in err


def test_reboot_by_a_number_needs_one_bus_that_has_it(mixed):
    code, _, err = gazerig("reboot", mixed, "1", "--mock")
    assert code == 2 and "1: which bus (the main bus, bus tilt)? name the joint instead" in err
    code, _, err = gazerig("reboot", mixed, "7", "--mock")
    assert code == 0 and "neck_yaw (servo 7): back after" in err


def test_reboot_of_a_maestro_says_what_there_is_instead():
    with served("maker") as (port, _, command):
        line = BlockingPort(port)
        line.setBaudRate(115_200)
        line.write(bytes.fromhex("84 00 70 2E 2B"))
        line.closePort()
        words = ("reboot", "maker", "eyes_pan", "--port", port)
        code, _, err = gazerig(*words, answers="n\n")
        assert code == 0 and "has no restart over its serial line" in err and "left as it is" in err
        assert json.loads(command("status"))["servos"][0]["position"] == 6000
        command("error crc")
        code, _, err = gazerig(*words, "--yes")
        assert code == 0 and "cleared now: serial CRC error" in err
        assert json.loads(command("status"))["servos"][0]["position"] == 0


def test_the_command_port_is_the_first_of_the_two_of_a_maestro(monkeypatch):
    both = [SerialPort(f"/dev/ttyNONE{n}", "Maestro", "1ffb:0089", None) for n in range(2)]
    monkeypatch.setattr(bench, "serial_ports", lambda host: both)
    assert "no serial port /dev/ttyNONE0" in gazerig("scan")[2]

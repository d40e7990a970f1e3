"""scan, doctor, setup and reboot of boards that move hobby servos, as people type them."""

import json
from pathlib import Path

import pytest
from command_line import invoked
from served_rigs import hide_real_ports, rig_files, served

from gazerig.config.schema import load_rig
from gazerig.drivers.serial.list_ports import SerialPort
from gazerig.drivers.serial.port import port_of
from gazerig.features.bringup.cli import ports
from gazerig.sim_mock.devices import MaestroLine
from gazerig.sim_mock.pty.client import PtyBus

pytestmark = pytest.mark.usefixtures("simulated_wires")


@pytest.fixture(autouse=True)
def no_real_ports(monkeypatch, tmp_path):
    hide_real_ports(monkeypatch, tmp_path)


@pytest.fixture
def on_pca9685(tmp_path):
    """Return the path of the maker's rig with a PCA9685 in place of its Maestro."""
    return rig_files(tmp_path)["pca9685"]


def test_scan_of_a_maestro():
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine())
        bus.command("error signal")
        bus.command("script on")
        code, out, _ = invoked("scan", "--port", path)
        assert code == 0 and "Pololu Maestro: 6 channels or more" in out
        assert "serial signal error" in out and "its own script runs" in out
        assert "nothing else was sent" in out and "searched dynamixel" not in out
        code, out, _ = invoked("scan", "--port", path, "--json", "--kind", "maestro")
        (board,) = json.loads(out)["boards"]
        assert code == 0 and board["script"] is True and board["errors"] == []


def test_servo_packets_are_never_sent_to_a_board_of_pololu(monkeypatch):
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(crc=True))
        board = SerialPort(path, "Pololu Mini Maestro", "1ffb:008a", None)
        monkeypatch.setattr(ports, "serial_ports", lambda host: (board,))
        for words in (
            ("scan", "--port", path, "--kind", "feetech"),
            ("scan", "--port", path, "--kind", "dynamixel"),
            ("setup", "--port", path, "--joint", "neck_yaw", "--yes"),
            ("setup", "feetech", "--port", path, "--joint", "neck_yaw", "--yes"),
            ("reboot", "neck_yaw", "--port", path),
            ("doctor", "--port", path),
        ):
            code, _, err = invoked(*words)
            assert code == 2 and "board of Pololu" in err and "would move" in err, words
        # Any packet of theirs would have been an error to it.
        assert json.loads(bus.command("status"))["errors"] == []
        code, out, _ = invoked("scan", "--port", path)
        assert code == 0 and "12 channels" in out
        assert invoked("doctor", "maker", "--port", path).code == 0


def test_setup_of_a_maestro_moves_one_channel_after_another_with_a_yes():
    answers = "\ny\n\ny\ny\nn\n"
    code, _, err = invoked(
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
        code, _, err = invoked(
            "setup", "maker", "--port", port, "--joint", "eyes_pan",
            # set; supply off; on again; move; it was another; move; that is it
            answers="\ny\n\ny\nn\ny\ny\n",
        )  # fmt: skip
        assert code == 0 and "ran a script of its own: stopped" in err
        assert "and the board stays at 1900 us: set its Min to 1088 and its Max to 1936" in err
        assert "plug its servo into channel 0" in err and "done: 1 of 1" in err
        first = json.loads(command("status"))["servos"][0]
        assert first["position"] == 0


@pytest.mark.pty
def test_setup_of_a_maestro_with_yes_does_not_guess_about_the_supply():
    code, _, err = invoked("setup", "maker", "--mock", "--yes", "--joint", "eyes_tilt")
    assert code == 0 and "--yes cannot know that the supply is off" in err and "done: 1 of 1" in err


def test_setup_of_a_maestro_that_does_not_answer():
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(), choices={"mode": "mute"})
        code, _, err = invoked("setup", "maker", "--port", path, "--yes", "--joint", "eyes_pan")
        assert code == 2 and "no Maestro answers: on USB take the first of its two ports" in err


def test_setup_of_a_board_that_is_too_small(monkeypatch):
    with PtyBus() as bus:
        path = bus.start_device(MaestroLine(6, crc=True))
        board = SerialPort(path, "Pololu Micro Maestro", "1ffb:0089", None)
        monkeypatch.setattr(ports, "serial_ports", lambda host: (board,))
        code, _, err = invoked("setup", "maker", "--port", path, "--yes", "--joint", "eyes_pan")
        assert code == 0 and "USB Dual Port" in err
        monkeypatch.setattr(
            "gazerig.features.bringup.cli.setup_boards.USB_CHANNELS", {"1ffb:0089": 2}
        )
        code, _, err = invoked("setup", "maker", "--port", path, "--yes")
        assert code == 2 and "has channels 0..1, not those of left_upper_lid (channel 2)" in err


def test_setup_of_a_pca9685_measures_its_clock_and_moves_one_channel_after_another(on_pca9685):
    with served(on_pca9685) as (port, _, command):
        command("set oscillator-mhz 25.44")
        code, _, err = invoked(
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
    code, _, err = invoked("setup", on_pca9685, "--mock", "--yes", "--joint", "eyes_pan")
    assert code == 0 and "--yes has no meter" in err and "done: 1 of 1" in err


def test_reboot_of_a_maestro_says_what_there_is_instead():
    with served("maker") as (port, _, command):
        line = port_of(port)
        line.setBaudRate(115_200)
        line.write(bytes.fromhex("84 00 70 2E 2B"))
        line.closePort()
        words = ("reboot", "maker", "eyes_pan", "--port", port)
        code, _, err = invoked(*words, answers="n\n")
        assert code == 0 and "has no restart over its serial line" in err and "left as it is" in err
        assert json.loads(command("status"))["servos"][0]["position"] == 6000
        command("error crc")
        code, _, err = invoked(*words, "--yes")
        assert code == 0 and "cleared now: serial CRC error" in err
        assert json.loads(command("status"))["servos"][0]["position"] == 0


def test_the_command_port_is_the_first_of_the_two_of_a_maestro(monkeypatch):
    both = [SerialPort(f"/dev/ttyNONE{n}", "Maestro", "1ffb:0089", None) for n in range(2)]
    monkeypatch.setattr(ports, "serial_ports", lambda host: both)
    assert "no serial port /dev/ttyNONE0" in invoked("scan").err


def test_doctor_and_setup_of_a_pca9685(on_pca9685):
    code, out, _ = invoked("doctor", on_pca9685, "--mock")
    assert code == 0 and "answers at 0x40; pulses on 0 of 6 channels" in out
    code, _, err = invoked("setup", on_pca9685, "--mock", "--yes")
    assert code == 0 and "board 0x40: jumpers none closed" in err
    assert "eyes_pan: channel 0 of board 0x40" in err

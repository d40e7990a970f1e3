"""The pseudo-terminal server with other kinds of devices, and with several buses in one process."""

import json
from pathlib import Path

import pytest

from gazerig.drivers.serial import port as serial_port
from gazerig.drivers.serial.port import BlockingPort
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine, MaestroLine
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.pty.client import PtyBus, PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec

STS_PING, STS_PONG = bytes.fromhex("FFFF010201FB"), bytes.fromhex("FFFF010200FC")


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A shared machine may stall a process for longer than the SDK waits for real servos."""
    monkeypatch.setattr(serial_port, "SDK_MARGIN_S", 5.0)


def asked(path, data, length, baud=1_000_000):
    """Send bytes to a path and give what is answered."""
    port = BlockingPort(path)
    port.setBaudRate(baud)
    port.write(data)
    answer = port.read_until(length, port.now_s() + 20.0)
    port.closePort()
    return answer


def test_a_board_tells_what_its_channels_send():
    with PtyBus() as bus:
        board = MaestroLine(12, servos=(HobbySpec(3, 5000.0),))
        path = bus.start_device(board, choices={"max-us": "1400"})
        assert asked(path, bytes.fromhex("9003"), 2, 115_200) == bytes(2)
        assert asked(path, bytes.fromhex("8403702E9003"), 2, 9600) == (5600).to_bytes(2, "little")
        assert asked(path, bytes.fromhex("AA0C21"), 2) == bytes(2)
        status = json.loads(bus.command("status"))
        assert len(status["servos"]) == 12


def test_the_buses_of_a_rig_live_in_one_process():
    with PtyBuses() as buses:
        paths = buses.start(
            {
                "": DynamixelLine((ServoSpec(1, "xl330-m288"),), baud=1_000_000),
                "neck": FeetechLine((ServoSpec(1, "sts3215"),), baud=1_000_000),
            }
        )
        assert list(paths) == ["", "neck"]
        assert asked(paths["neck"], STS_PING, 6) == STS_PONG
        assert len(asked(paths[""], bytes.fromhex("FFFFFD0001030001194E"), 14)) == 14
        assert buses.command("lose 1 count 1", "neck") == "servo 1 does not answer 1 times"
        assert json.loads(buses.command("status", "neck"))["faults"] == ["lose 1"]
        assert json.loads(buses.command("status"))["faults"] == []
        buses.command("unplug", "neck")
        assert [Path(path).exists() for path in paths.values()] == [True, False]
        buses.command("plug", "neck")
        assert asked(paths["neck"], STS_PING + STS_PING, 6) == STS_PONG
        pid = buses.pid
    assert not Path(f"/proc/{pid}").exists()


def test_a_command_for_no_bus_is_refused_with_the_names():
    with PtyBuses() as buses:
        line = DynamixelLine((ServoSpec(1, "xl330-m288"),))
        buses.start({"eyes": line, "neck": line})
        with pytest.raises(ValueError, match=r"name the bus first \(eyes, neck\): eyes: status"):
            buses.command("status")
        with pytest.raises(ValueError, match="name the bus first"):
            buses.command("status", "tail")


def test_a_bus_that_cannot_be_ends_the_others(capfd):
    with PtyBuses() as buses, pytest.raises(RuntimeError, match="did not start"):
        buses.start(
            {
                "eyes": DynamixelLine((ServoSpec(1, "xl330-m288"),)),
                "neck": DynamixelLine((ServoSpec(1, "xl330-m288"),), baud=12),
            }
        )
    assert "baud 12: xl330-m288 supports" in capfd.readouterr().err

"""The pseudo-terminal server: start, stop, and clients that are not ours."""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler
from present import present

from gazerig.drivers.dynamixel.protocol import instruction
from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.serial import port as serial_port
from gazerig.drivers.serial.port import BlockingPort
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.pty.client import PtyBus, PtyBuses
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import ServerSettings
from gazerig.sim_mock.smart_servo.physics import ServoSpec

SPECS = [(1, "xl330-m288", 2048), (2, "xl330-m288", 1000), (3, "xl330-m288", 3000)]
DEVICE = DynamixelLine(tuple(ServoSpec(*spec) for spec in SPECS))
ROOT = Path(__file__).parents[1]
PING, PONG = bytes.fromhex("FFFFFD0001030001194E"), 14
STS_PING, STS_PONG = bytes.fromhex("FFFF010201FB"), bytes.fromhex("FFFF010200FC")


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A shared machine may stall a process for longer than the SDK waits for real servos."""
    monkeypatch.setattr(serial_port, "SDK_MARGIN_S", 5.0)


@pytest.fixture
def path():
    with PtyBus() as bus:
        yield bus.start(SPECS)


@pytest.fixture
def server(tmp_path):
    """Start a server as a client does, and give it with its terminal."""
    settings = tmp_path / "settings"
    settings.write_bytes(pickle.dumps(ServerSettings((BusSettings(DEVICE),), until_eof=True)))
    command = [sys.executable, "-m", "gazerig.sim_mock.pty.server", str(settings)]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as started:
        yield started, json.loads(present(started.stdout).readline())["path"]


def test_the_server_says_its_path_and_ends_with_its_parents_pipe(server):
    process, terminal = server
    assert Path(terminal).is_char_device()
    present(process.stdin).close()
    assert process.wait(60) == 0


def test_the_server_ignores_ctrl_c_and_heeds_sigterm(server):
    process, terminal = server
    process.send_signal(signal.SIGINT)
    port = BlockingPort(terminal)
    port.setBaudRate(1_000_000)
    assert PacketHandler(2.0).ping(port, 1)[1] == COMM_SUCCESS
    port.closePort()
    held = os.open(terminal, os.O_RDONLY | os.O_NOCTTY)
    process.terminate()
    assert process.wait(60) == 0
    assert os.read(held, 1) == b""  # hung up; another test may have its number by now
    os.close(held)


def test_the_server_loads_nothing_heavy():
    code = "import sys, gazerig.sim_mock.pty.server; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numpy", "cv2", "serial", "dynamixel_sdk", "pydantic"} & set(loaded)


def test_a_wrong_specification_is_an_error(capfd):
    with PtyBus() as bus, pytest.raises(RuntimeError, match="did not start"):
        bus.start([(1, "no-such-model", 2048)])
    assert "no-such-model" in capfd.readouterr().err


def test_a_full_terminal_does_not_stop_the_server(path):
    """A client that asks and never listens loses answers; the next one is served."""
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    for _ in range(2000):
        os.write(fd, PING)
    os.close(fd)
    port = BlockingPort(path)
    port.setBaudRate(1_000_000)
    port.drain()
    assert PacketHandler(2.0).ping(port, 1)[1] == COMM_SUCCESS
    port.closePort()


# --- commands while it runs


@pytest.fixture(scope="module")
def strict():
    """Serve three servos that heed the baud rate."""
    with PtyBus() as bus:
        bus.path = bus.start(SPECS, baud=1_000_000)  # type: ignore[attr-defined]
        yield bus


@pytest.fixture
def client(strict):
    strict.command("clear")
    port = BlockingPort(strict.path)
    port.setBaudRate(1_000_000)
    yield port
    port.closePort()
    strict.command("clear")


def found(port, servo_id=1):
    """Return whether a servo answers."""
    return PacketHandler(2.0).ping(port, servo_id)[1] == COMM_SUCCESS


def take_errors(port, servo_id=1):
    """Return whether a servo stays silent; who awaits silence waits for less of it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(serial_port, "SDK_MARGIN_S", 0.1)
        return not found(port, servo_id)


def test_faults_by_command(strict, client):
    assert strict.command("lose 1 count 1") == "servo 1 does not answer 1 times"
    assert take_errors(client)
    assert found(client)
    with pytest.raises(ValueError, match="'lsoe' is not a command"):
        strict.command("lsoe 1")
    servos = json.loads(strict.command("status"))["servos"]
    assert [servo["position"] for servo in servos] == [2048, 1000, 3000]
    assert "usage" not in strict.command("help")


def test_unplug_is_an_error_and_plug_brings_the_name_back(strict, client):
    for _ in range(2):
        strict.command("unplug")
        with pytest.raises(BusLost):
            found(client)
        assert not Path(strict.path).exists()
        with pytest.raises(PortError, match="no serial port"):
            client.setBaudRate(1_000_000)
        strict.command("plug")
        client.setBaudRate(1_000_000)
        assert found(client)


def test_forbidding_takes_the_rights_of_the_terminal(strict):
    strict.command("deny on")
    assert os.stat(strict.path).st_mode & 0o777 == 0
    strict.command("deny off")
    assert os.stat(strict.path).st_mode & 0o777 == 0o620


# --- clients that set nothing


def opened(path):
    return os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)


def answers(fd, expected, timeout_s=5.0):
    got, end_s = b"", time.monotonic() + timeout_s
    while len(got) < expected and time.monotonic() < end_s:
        try:
            got += os.read(fd, 4096)
        except BlockingIOError:
            time.sleep(0.001)
    return got


def test_every_byte_value_passes_in_both_directions(path):
    fd = opened(path)
    for start in range(0, 256, 16):
        values = bytes(range(start, start + 16))
        os.write(fd, instruction(1, 3, b"\xe0\x00" + values))
        assert len(answers(fd, 11)) == 11
        os.write(fd, instruction(1, 2, b"\xe0\x00\x10\x00"))
        assert answers(fd, 27)[9:-2] == values
    os.close(fd)


def test_answers_that_a_client_did_not_read_are_not_the_next_ones(path):
    fd = opened(path)
    os.write(fd, PING)
    time.sleep(0.05)
    os.close(fd)
    time.sleep(0.05)
    fd = opened(path)
    with pytest.raises(BlockingIOError):
        os.read(fd, 100)
    os.write(fd, PING)
    assert len(answers(fd, 2 * PONG, 0.1)) == PONG
    os.close(fd)


# --- other kinds of devices, and several buses in one process


def asked(path, data, length, baud=1_000_000):
    """Send bytes to a path and give what is answered."""
    port = BlockingPort(path)
    port.setBaudRate(baud)
    port.write(data)
    answer = port.read_until(length, port.now_s() + 20.0)
    port.closePort()
    return answer


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

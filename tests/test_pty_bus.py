"""The pseudo-terminal server: start, stop, and clients that are not ours."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler
from present import present

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.serial import port as serial_port
from gazerig.drivers.serial.port import BlockingPort
from gazerig.sim_mock.pty.client import PtyBus

SPECS = [(1, "xl330-m288", 2048), (2, "xl330-m288", 1000), (3, "xl330-m288", 3000)]
DEVICE = {"kind": "dynamixel", "servos": SPECS}
ROOT = Path(__file__).parents[1]
STS_PING, STS_PONG = bytes.fromhex("FFFF010201FB"), bytes.fromhex("FFFF010200FC")


@pytest.fixture(autouse=True)
def patient(monkeypatch):
    """A shared machine may stall a process for longer than the SDK waits for real servos."""
    monkeypatch.setattr(serial_port, "SDK_MARGIN_S", 5.0)


@pytest.fixture
def path():
    with PtyBus() as bus:
        yield bus.start(SPECS)


def start_server(**options) -> subprocess.Popen:
    return subprocess.Popen(
        [
            sys.executable,
            "-m",
            "gazerig.sim_mock.pty.server",
            json.dumps({"buses": [{"device": DEVICE}], "until_eof": True}),
        ],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        **options,
    )


def test_the_server_says_its_path_and_ends_with_its_parents_pipe():
    server = start_server()
    terminal = json.loads(present(server.stdout).readline())["path"]
    assert Path(terminal).is_char_device()
    present(server.stdin).close()
    assert server.wait(60) == 0
    present(server.stdout).close()


def test_the_server_ignores_ctrl_c_and_heeds_sigterm():
    server = start_server()
    terminal = json.loads(present(server.stdout).readline())["path"]
    server.send_signal(signal.SIGINT)
    port = BlockingPort(terminal)
    port.setBaudRate(1_000_000)
    assert PacketHandler(2.0).ping(port, 1)[1] == COMM_SUCCESS
    port.closePort()
    server.terminate()
    assert server.wait(60) == 0
    assert not Path(terminal).exists()
    present(server.stdin).close()
    present(server.stdout).close()


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
        os.write(fd, bytes.fromhex("FFFFFD0001030001194E"))
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
    strict.command("set baud heed")


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


def test_with_wire_time_nothing_comes_before_it_is_due():
    with PtyBus() as bus:
        port = BlockingPort(bus.start(SPECS, baud=57_600, wire_time=True))
        port.setBaudRate(57_600)
        read = bytes.fromhex("FFFFFD0001070002840004001D15")
        for _ in range(5):
            began = port.now_s()
            port.write(read)
            assert len(port.read_until(15, began + 30.0)) == 15
            assert port.now_s() - began >= (14 + 15) * 10 / 57_600 + 500e-6
        port.closePort()

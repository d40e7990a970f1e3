"""The pseudo-terminal server: start, stop, and clients that are not ours."""

import json
import os
import pickle
import select
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from subprocess import PIPE

import pytest
from fakes.pty_bus import PtyBus
from present import present

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.serial.port import BlockingPort
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import ServerSettings
from gazerig.sim_mock.smart_servo.physics import ServoSpec

SERVO = ServoSpec(1, "xl330-m288")
DEVICE = DynamixelLine((SERVO,), 1_000_000)
ROOT = Path(__file__).parents[2]
PING = bytes.fromhex("FFFFFD0001030001194E")
WAIT_S = 5.0
STS_PING, STS_PONG = bytes.fromhex("FFFF010201FB"), bytes.fromhex("FFFF010200FC")


@pytest.fixture(scope="module")
def bus():
    with PtyBus() as started:
        started.path = started.start_device(DEVICE)  # type: ignore[attr-defined]
        yield started


def port_at(path):
    port = BlockingPort(str(path))
    port.setBaudRate(1_000_000)
    return port


def found(port):
    """Return whether the servo answers."""
    # A shared machine may stall a process for seconds.
    port.drain(0.0)
    port.write(PING)
    return len(port.read_until(14, port.now_s() + WAIT_S)) == 14


@contextmanager
def server(tmp_path, *options):
    """Start a server as a client does, and give it with its terminal."""
    settings = tmp_path / "settings"
    settings.write_bytes(pickle.dumps(ServerSettings((BusSettings(DEVICE),), until_eof=True)))
    command = [sys.executable, *options, "-m", "gazerig.sim_mock.pty.server", str(settings)]
    with subprocess.Popen(command, cwd=ROOT, stdin=PIPE, stdout=PIPE, stderr=PIPE) as started:
        yield started, json.loads(present(started.stdout).readline())["path"]


def test_the_server_ignores_ctrl_c_and_ends_with_its_parents_pipe_or_when_asked(tmp_path, capfd):
    with server(tmp_path) as (process, terminal):
        process.send_signal(signal.SIGINT)
        port = port_at(terminal)
        assert found(port)
        port.closePort()
        held = os.open(terminal, os.O_RDONLY | os.O_NOCTTY)
        process.terminate()
        assert process.wait(60) == 0
        assert os.read(held, 1) == b""  # hung up; another test may have its number by now
        os.close(held)
    with server(tmp_path, "-X", "importtime") as (process, _):
        present(process.stdin).close()
        imported = {line.split()[-1] for line in present(process.stderr).read().splitlines()}
        assert process.wait(60) == 0
    assert b"gazerig.sim_mock.pty.line" in imported
    assert not imported & {b"numpy", b"cv2", b"serial", b"dynamixel_sdk", b"pydantic"}
    with PtyBus() as wrong, pytest.raises(RuntimeError, match="did not start"):
        wrong.start([(1, "no-such-model", 2048)])
    assert "no-such-model" in capfd.readouterr().err


def test_clients_come_go_forget_to_listen_and_are_unplugged(bus):
    fd = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)
    for _ in range(2000):
        os.write(fd, PING)
    os.close(fd)
    port = port_at(bus.path)
    port.drain()
    assert found(port)
    port.closePort()
    flags = os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK
    fd = os.open(bus.path, flags)
    os.write(fd, PING)
    time.sleep(0.05)
    os.close(fd)
    time.sleep(0.05)
    fd = os.open(bus.path, flags)
    assert select.select([fd], (), (), 0.0)[0] == []
    os.close(fd)
    client = port_at(bus.path)
    for _ in range(2):
        bus.command("unplug")
        with pytest.raises(BusLost):
            found(client)
        assert not Path(bus.path).exists()
        with pytest.raises(PortError, match="no serial port"):
            client.setBaudRate(1_000_000)
        bus.command("plug")
        client.setBaudRate(1_000_000)
        assert found(client)
    client.closePort()


def test_the_buses_of_a_rig_live_in_one_process():
    with PtyBuses() as buses:
        paths = buses.start({"eyes": DEVICE, "neck": FeetechLine((ServoSpec(1, "sts3215"),))})
        assert list(paths) == ["eyes", "neck"]
        neck = port_at(paths["neck"])
        neck.write(STS_PING)
        assert neck.read_until(6, neck.now_s() + 20.0) == STS_PONG
        neck.closePort()
        assert buses.command("lose 1 count 1", "neck") == "servo 1 does not answer 1 times"
        assert json.loads(buses.command("status", "neck"))["faults"] == ["lose 1"]
        assert json.loads(buses.command("status", "eyes"))["faults"] == []
        with pytest.raises(ValueError, match=r"name the bus first \(eyes, neck\): eyes: status"):
            buses.command("status")
        buses.command("unplug", "neck")
        assert [Path(path).exists() for path in paths.values()] == [True, False]
        with pytest.raises(ValueError, match="'lsoe' is not a command"):
            buses.command("lsoe 1", "eyes")
        pid = buses.pid
    assert not Path(f"/proc/{pid}").exists()

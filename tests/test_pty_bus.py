"""The pseudo-terminal server: start, stop, and clients that are not ours."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, GroupSyncWrite, PacketHandler

from drivers.dynamixel_port import BlockingPort
from sim_mock.pty_bus import PtyBus
from sim_mock.servo import ServoSpec

SPECS = [(1, "xl330-m288", 2048), (2, "xl330-m288", 1000), (3, "xl330-m288", 3000)]
ROOT = Path(__file__).parents[1]


@pytest.fixture
def path():
    with PtyBus() as bus:
        yield bus.start(SPECS)


def start_server(**options) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "sim_mock.pty_bus", json.dumps(SPECS)],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        **options,
    )


def test_the_server_says_its_path_and_ends_with_its_parents_pipe():
    server = start_server()
    terminal = json.loads(server.stdout.readline())["path"]
    assert Path(terminal).is_char_device()
    server.stdin.close()
    assert server.wait(10) == 0
    server.stdout.close()


def test_the_server_ignores_ctrl_c_and_heeds_sigterm():
    server = start_server()
    terminal = json.loads(server.stdout.readline())["path"]
    server.send_signal(signal.SIGINT)
    port = BlockingPort(terminal)
    port.setBaudRate(1_000_000)
    assert PacketHandler(2.0).ping(port, 1)[1] == COMM_SUCCESS
    port.closePort()
    server.terminate()
    assert server.wait(10) == -signal.SIGTERM
    server.stdin.close()
    server.stdout.close()


def test_the_server_loads_nothing_heavy():
    code = "import sys, sim_mock.pty_bus; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numpy", "cv2", "serial", "dynamixel_sdk", "pydantic"} & set(loaded)


def test_clients_may_come_and_go(path):
    for _ in range(2):
        port = BlockingPort(path)
        port.setBaudRate(1_000_000)
        assert PacketHandler(2.0).ping(port, 2)[:2] == (1200, COMM_SUCCESS)
        port.closePort()


def test_a_wrong_specification_is_an_error(capfd):
    with PtyBus() as bus, pytest.raises(RuntimeError, match="did not start"):
        bus.start([(1, "no-such-model", 2048)])
    assert "no-such-model" in capfd.readouterr().err


def test_the_sdk_moves_servos_over_the_terminal(path):
    port, packets = BlockingPort(path), PacketHandler(2.0)
    port.setBaudRate(1_000_000)
    group = GroupSyncWrite(port, packets, 64, 1)
    goals = GroupSyncWrite(port, packets, 116, 4)
    places = GroupSyncRead(port, packets, 132, 4)
    for servo_id in (1, 2, 3):
        group.addParam(servo_id, [1])
        goals.addParam(servo_id, [0xD0, 0x07, 0, 0])
        places.addParam(servo_id)
    assert group.txPacket() == COMM_SUCCESS
    assert goals.txPacket() == COMM_SUCCESS
    time.sleep(0.6)
    for read in (places.txRxPacket, places.fastSyncRead):
        assert read() == COMM_SUCCESS
        assert [places.getData(i, 132, 4) for i in (1, 2, 3)] == [2000] * 3
    port.closePort()


def test_an_independent_client_understands_the_bus(path):
    rustypot = pytest.importorskip("rustypot", reason="rustypot is not installed")
    client = rustypot.Xl330PyController(path, 1_000_000, 0.5)
    assert client.ping(1) is True
    assert client.sync_read_raw_present_position([1, 2, 3]) == [2048, 1000, 3000]
    client.sync_write_torque_enable([1, 2, 3], [True, True, True])
    client.sync_write_raw_goal_position([1, 2, 3], [1500, 1500, 1500])
    time.sleep(0.8)
    assert client.sync_read_raw_present_position([3, 1, 2]) == [1500, 1500, 1500]
    client.set_fast_sync_read(True)
    assert client.sync_read_raw_present_position([3, 1, 2]) == [1500, 1500, 1500]
    assert client.read_hardware_error_status(1) in (0, [0])
    client.close()


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


def test_named_specs_travel_to_the_server():
    with PtyBus() as bus:
        port = BlockingPort(bus.start([ServoSpec(9, "xl330-m288", 1234, firmware=45)]))
        port.setBaudRate(1_000_000)
        packets = PacketHandler(2.0)
        assert packets.read1ByteTxRx(port, 9, 6)[0] == 45
        assert packets.read4ByteTxRx(port, 9, 132)[0] == 1234
        port.closePort()

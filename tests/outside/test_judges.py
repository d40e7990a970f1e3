"""Clients that others wrote do all they can on the emulated bus: Rust, and the vendor's SDK."""

import time

import dynamixel_sdk as sdk
import pytest
from fakes.pty_bus import PtyBus
from fakes.sdk_port import SdkPort
from fakes.waiting import eventually

from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort

BAUD = 1_000_000
IDS = (1, 2, 3)
PLACES = (2048, 1000, 3000)
SPECS = [(i, "xl330-m288", place) for i, place in zip(IDS, PLACES, strict=True)]
X430 = [(11, "xl430-w250", 1024), (12, "xm430-w350", 2048)]

STEADY_STEPS = 12
"""Friction keeps a servo with factory gains so far from its goal."""


@pytest.fixture
def path():
    with PtyBus() as bus:
        yield bus.start([*SPECS, *X430], baud=BAUD)


def near(places, goal):
    return all(abs(place - goal) < STEADY_STEPS for place in places)


# --- Rust


def test_rustypot_with_x330(path):
    open_client = pytest.importorskip("rustypot").Xl330PyController
    ids = list(IDS)
    hasty = open_client(path, BAUD, 0.1)  # it waits for three servos that are not there
    assert eventually(lambda: hasty.scan(list(range(6))) == {1: 1200, 2: 1200, 3: 1200})
    assert hasty.ping(4) is False
    hasty.close()
    client = open_client(path, BAUD, 1.0)
    assert [client.ping(i) for i in ids] == [True, True, True]
    assert client.broadcast_scan(ids) == {1: 1200, 2: 1200, 3: 1200}
    assert client.sync_read_raw_present_position(ids) == list(PLACES)
    assert client.read_raw_data_with_error(1, 132, 4) == ([0, 8, 0, 0], 0)
    client.sync_write_torque_enable(ids, [True] * 3)
    client.sync_write_raw_goal_position(ids, [1500] * 3)
    assert eventually(lambda: near(client.sync_read_raw_present_position([3, 1, 2]), 1500))
    client.set_fast_sync_read(True)
    # They may have been seen while passing it.
    assert eventually(lambda: near(client.sync_read_raw_present_position([3, 1, 2]), 1500))
    client.set_fast_sync_read(False)
    client.reboot(1)
    time.sleep(0.45)
    assert client.read_torque_enable(1) in (False, [False])
    assert client.write_raw_data_with_error(3, 7, [9]) == 7
    assert client.read_raw_data_with_error(3, 40, 4)[1] == 7
    client.close()


# --- the vendor's SDK


def test_the_vendors_sdk():
    """Do what the SDK's packet handler and groups can in position mode; fails by assertion.

    Its time-outs of 34 ms are too short for a busy machine: its port is one in this process, whose
    time passes as it is waited for.
    """
    port, packets = SimulatedPort(), sdk.PacketHandler(2.0)
    ok = sdk.COMM_SUCCESS
    assert packets.ping(port, 1) == (1200, ok, 0)
    assert packets.ping(port, 99)[1] == sdk.COMM_RX_TIMEOUT
    found, result = packets.broadcastPing(port)
    assert result == ok
    assert {i: tuple(values) for i, values in found.items()} == {
        1: (1200, 53), 2: (1200, 53), 3: (1200, 53), 11: (1060, 53), 12: (1020, 53)
    }  # fmt: skip
    registers_with_sdk(port, packets)
    groups_with_sdk(port, packets)
    instructions_with_sdk(port, packets)


class SimulatedPort(SdkPort):
    """A port of the SDK whose clock advances with each wait."""

    def __init__(self):
        self._t_s = 0.0
        chain = build_dynamixel([*SPECS, *X430], lambda: self._t_s, baud=BAUD)
        port = InProcessPort(chain, sleep_until=self._pass_until, wire_time=True)
        port.setBaudRate(BAUD)
        super().__init__(port)

    def _pass_until(self, t_s):
        self._t_s = max(self._t_s, t_s)

    def let_pass(self, seconds):
        self._t_s += seconds

    def eventually(self, check):
        """Wait five seconds for something to become true."""
        for _ in range(250):
            if check():
                return True
            self.let_pass(0.02)
        return False


def registers_with_sdk(port, packets):
    ok = sdk.COMM_SUCCESS
    assert packets.read4ByteTxRx(port, 2, 132) == (1000, ok, 0)
    assert packets.write1ByteTxRx(port, 1, 65, 1) == (ok, 0)
    assert packets.read1ByteTxRx(port, 1, 65) == (1, ok, 0)
    assert packets.write2ByteTxRx(port, 1, 84, 700) == (ok, 0)
    assert packets.read2ByteTxRx(port, 1, 84) == (700, ok, 0)
    assert packets.write4ByteTxRx(port, 1, 116, 5000) == (ok, 6)
    assert packets.write1ByteTxRx(port, 1, 7, 253) == (ok, 4)
    assert packets.write1ByteTxRx(port, 1, 132, 1) == (ok, 7)
    data, result, error = packets.readTxRx(port, 1, 124, 23)
    assert (len(data), result, error) == (23, ok, 0)
    packets.write1ByteTxOnly(port, 1, 65, 0)
    port.let_pass(0.02)
    port.clearPort()
    port.is_using = False
    assert packets.read1ByteTxRx(port, 1, 65) == (0, ok, 0)


def groups_with_sdk(port, packets):
    ok = sdk.COMM_SUCCESS
    torque = sdk.GroupSyncWrite(port, packets, 64, 1)
    goals = sdk.GroupSyncWrite(port, packets, 116, 4)
    places = sdk.GroupSyncRead(port, packets, 132, 4)
    for servo_id in IDS:
        assert torque.addParam(servo_id, [1]) and places.addParam(servo_id)
        assert goals.addParam(servo_id, [0xDC, 0x05, 0, 0])
    assert places.txRxPacket() == ok
    assert tuple(places.getData(i, 132, 4) for i in IDS) == PLACES
    assert torque.txPacket() == ok and goals.txPacket() == ok
    for read in (places.txRxPacket, places.fastSyncRead):
        assert port.eventually(
            lambda read=read: read() == ok and near([places.getData(i, 132, 4) for i in IDS], 1500)
        )
    writes = sdk.GroupBulkWrite(port, packets)
    assert writes.addParam(1, 65, 1, [1]) and writes.addParam(2, 112, 4, [40, 0, 0, 0])
    assert writes.txPacket() == ok
    bulk = sdk.GroupBulkRead(port, packets)
    assert bulk.addParam(1, 65, 1) and bulk.addParam(2, 112, 4) and bulk.addParam(3, 144, 2)
    for read in (bulk.txRxPacket, bulk.fastBulkRead):
        assert read() == ok
        got = bulk.getData(1, 65, 1), bulk.getData(2, 112, 4)
        assert got == (1, 40)
        assert 45 <= bulk.getData(3, 144, 2) <= 50


def instructions_with_sdk(port, packets):
    ok = sdk.COMM_SUCCESS
    rebooted = packets.reboot(port, 3)
    assert rebooted == (ok, 0)
    assert packets.ping(port, 3)[1] == sdk.COMM_RX_TIMEOUT
    port.let_pass(0.45)
    assert packets.read1ByteTxRx(port, 3, 64) == (0, ok, 0)
    assert packets.write1ByteTxRx(port, 3, 7, 5) == (ok, 0)
    assert packets.ping(port, 5) == (1200, ok, 0)


def test_the_vendors_sdk_opens_a_terminal(path):
    port, packets = sdk.PortHandler(path), sdk.PacketHandler(2.0)
    assert port.openPort() and port.setBaudRate(BAUD)
    assert eventually(lambda: packets.ping(port, 1) == (1200, sdk.COMM_SUCCESS, 0))
    assert eventually(lambda: packets.read4ByteTxRx(port, 2, 132) == (1000, sdk.COMM_SUCCESS, 0))
    assert packets.ping(port, 99)[1] == sdk.COMM_RX_TIMEOUT
    port.closePort()

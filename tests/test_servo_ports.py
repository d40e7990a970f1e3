"""The in-process port: the vendor's SDK, unchanged, on Dynamixel servos; bytes on the others."""

import pytest
from dynamixel_sdk import (
    PacketHandler,
)

from gazerig.drivers.errors import BusLost, PortError
from gazerig.sim_mock.devices import DynamixelLine, Emulated, FeetechLine, MaestroLine, build
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec


class World:
    def __init__(self):
        self.now_s = 0.0
        self.sent: list[bytes] = []
        specs = [(1, "xl330-m288", 2048), (2, "xl330-m288", 1000), (3, "xl330-m288", 3000)]
        self.chain = build_dynamixel(specs, lambda: self.now_s)
        self.port = InProcessPort(self.chain, self.sent.append)
        self.packets = PacketHandler(2.0)
        assert self.port.openPort()


@pytest.fixture
def world():
    return World()


def test_the_tap_hears_every_byte_the_host_sends(world):
    world.packets.ping(world.port, 1)
    assert world.sent == [bytes.fromhex("FFFFFD0001030001194E")]


def test_reading_part_of_an_answer_leaves_the_rest(world):
    world.port.write(bytes.fromhex("FFFFFD0001030001194E"))
    assert world.port.getBytesAvailable() == 14
    first = world.port.read_until(4, 0.0)
    assert (first, world.port.getBytesAvailable()) == (b"\xff\xff\xfd\x00", 10)
    assert world.port.drain() == 10
    assert world.port.read_until(4, 0.0) == b""


# --- any device


KINDS: dict[str, tuple[Emulated, bytes, int]] = {
    "dynamixel": (
        DynamixelLine((ServoSpec(1, "xl330-m288"),), 57_600),
        bytes.fromhex("FFFFFD0001030001194E"),
        14,
    ),
    "feetech": (FeetechLine((ServoSpec(1, "sts3215"),), 500_000), bytes.fromhex("FFFF010201FB"), 6),
    "maestro": (MaestroLine(6, baud=9600), bytes.fromhex("9001"), 2),
}


@pytest.fixture(params=KINDS)
def kind(request):
    line, question, length = KINDS[request.param]
    now = [0.0]
    device = build(line, lambda: now[0])

    def sleep_until(t_s):
        now[0] = max(now[0], t_s)

    port = InProcessPort(device, sleep_until=sleep_until)
    return port, line.baud, question, length


def test_every_device_answers_at_its_own_rate(kind):
    port, baud, question, length = kind
    port.setBaudRate(baud)
    port.write(question)
    assert len(port.read_until(length, 1.0)) == length
    assert port.now_s() == 0.0
    port.setBaudRate(baud * 2 if baud != 57_600 else 115_200)
    port.write(question)
    assert port.read_until(1, 0.01) == b""


def test_every_device_can_be_unplugged_and_come_back(kind):
    port, baud, question, length = kind
    port.setBaudRate(baud)
    port.faults.command("unplug")
    with pytest.raises(BusLost, match="plug the adapter in"):
        port.write(question)
    with pytest.raises(PortError):
        port.setBaudRate(baud)
    port.faults.command("plug")
    port.setBaudRate(baud)
    port.write(question)
    assert len(port.read_until(length, 1.0)) == length


def test_every_device_may_answer_late(kind):
    port, baud, question, length = kind
    port.setBaudRate(baud)
    port.faults.command("delay all 20 count 1")
    port.write(question)
    assert port.read_until(length, 0.01) == b""
    assert port.now_s() == pytest.approx(0.01)
    assert len(port.read_until(length, 1.0)) == length
    assert port.now_s() == pytest.approx(0.02)

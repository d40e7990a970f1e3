"""Each fault of the line, injected by text, as seen in the bytes at the host."""

import struct

import pytest
from dynamixel_sdk import PacketHandler
from fakes.sdk_port import SdkPort

from gazerig.sim_mock.devices import DynamixelLine, build
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

POSITION, SIZE = 132, 4


class World:
    """Three servos, a port, and a clock that waiting moves on."""

    def __init__(self):
        self.now_s = 0.0
        line = DynamixelLine(tuple(ServoSpec(i, "xl330-m077", 2000 + i) for i in (1, 2, 3)))
        device = build(line, lambda: self.now_s)
        self.port = InProcessPort(device, sleep_until=self.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.faults = self.port.faults
        self.packets = PacketHandler(2.0)

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def raw(self, servo_id=2, wait_s=0.1):
        """Ask for a position and give all bytes that arrive in time."""
        self.packets.readTx(SdkPort(self.port), servo_id, POSITION, SIZE)
        return self.port.read_until(200, self.now_s + wait_s)


@pytest.fixture
def world():
    return World()


def test_lost_late_cut_and_damaged_answers(world):
    whole = world.raw()
    assert whole[9:13] == struct.pack("<i", 2002) and len(whole) == 15
    world.faults.command("lose 2 count 2")
    assert [world.raw(), world.raw(), world.raw()] == [b"", b"", whole]
    world.faults.command("delay 2 30 count 1")
    assert world.raw(wait_s=0.02) == b""
    assert world.port.drain() == 0
    assert world.port.read_until(15, world.now_s + 0.1) == whole
    world.faults.command("truncate 2 9 count 1")
    assert world.raw() == whole[:9]
    world.faults.command("corrupt 2 72 count 1")
    assert world.raw()[9] == whole[9] ^ 1
    assert world.raw() == whole


def test_an_echo_and_noise_on_all_bytes(world):
    whole = world.raw()
    world.faults.command("echo")
    assert world.raw().endswith(whole) and len(world.raw()) > len(whole)
    world.faults.command("clear")
    for percent, kept in ((100, 1000), (20, 3400)):
        # Of each four bytes hit two are changed, one is lost, one follows another.
        world.faults.command(f"static {percent} for 1")
        noisy = world.faults.add_noise(bytes(4000))
        assert len(noisy) == pytest.approx(4000, abs=150)
        assert noisy.count(0) == pytest.approx(kept, abs=100)
        world.faults.command("clear")
    world.faults.command("static 100 for 1")
    assert world.raw() != whole
    world.now_s += 1.0
    assert world.raw() == whole


def test_faults_last_for_a_count_a_time_or_until_cleared(world):
    for text in ("lose 1 count 1", "lose 2 for 1", "lose 3"):
        world.faults.command(text)
    assert [world.raw(i) for i in (1, 2, 3)] == [b""] * 3
    assert world.raw(1) and not world.raw(2)
    world.now_s = 5.0
    assert world.raw(2) and not world.raw(3)
    world.faults.command("clear")
    assert world.raw(3)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("lsoe 3", "'lsoe' is not a command; commands: lose, delay"),
        ("lose x", "'x' is not ID from 0 to 252"),
        ("delay 3 nan", "'nan' is not MS from 0 to 60000"),
    ],
)
def test_a_wrong_word_is_named_with_what_would_be_right(world, text, says):
    with pytest.raises(ValueError) as error:
        world.faults.command(text)
    assert says in str(error.value)

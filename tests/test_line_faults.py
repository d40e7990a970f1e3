"""Each fault of the line, injected by text, as seen in the bytes at the host."""

import struct

import pytest
from fastcrc.crc16 import umts

from gazerig.drivers.errors import BusLost, PortError
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.in_process_port import InProcessPort

IDS = (1, 2, 3)
READ_ONE = (2, struct.pack("<HH", 132, 4))
READ_ALL = struct.pack("<HH", 132, 4) + bytes(IDS)


def instruction(servo_id, code, params=b""):
    packet = b"\xff\xff\xfd\x00" + struct.pack("<BHB", servo_id, len(params) + 3, code) + params
    return packet + struct.pack("<H", umts(packet))


def good(servo_id):
    """Return the status of an unspoilt read of the position."""
    return status(servo_id, 0, struct.pack("<i", 2000 + servo_id))


class World:
    """Three servos, a port, and a clock that waiting moves on."""

    def __init__(self, sleeps=True, **options):
        self.now_s = 0.0
        chain = build_dynamixel(
            [(i, "xl330-m077", 2000 + i) for i in IDS], lambda: self.now_s, **options
        )
        self.port = InProcessPort(chain, sleep_until=self.sleep_until if sleeps else None)
        self.port.setBaudRate(1_000_000)
        self.faults = self.port.faults

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def ask(self, servo_id, code, params=b"", timeout_s=0.1):
        """Send one instruction and give all that arrives in time."""
        self.port.write(instruction(servo_id, code, params))
        return self.port.read_until(2000, self.now_s + timeout_s)

    def one(self, servo_id=2):
        return self.ask(servo_id, *READ_ONE)

    def plain(self):
        return self.ask(0xFE, 0x82, READ_ALL)

    def fast(self):
        return self.ask(0xFE, 0x8A, READ_ALL)


GOLDEN_PING = bytes.fromhex("FFFFFD0001030001194E")


def sound(packet):
    return umts(packet[:-2]) == int.from_bytes(packet[-2:], "little")


@pytest.fixture
def world():
    return World()


def test_a_lost_answer_silences_those_behind_it(world):
    world.faults.command("lose 2 count 3")
    assert world.one() == b""
    assert world.plain() == good(1)
    assert len(world.fast()) == 8 + 8
    assert world.plain() == good(1) + good(2) + good(3)


def test_a_late_answer_arrives_when_the_clock_gets_there(world):
    world.faults.command("delay 2 30 count 1")
    world.port.write(instruction(2, *READ_ONE))
    assert world.port.read_until(15, 0.02) == b""
    assert world.now_s == 0.02
    assert world.port.drain() == 0
    assert world.port.read_until(15, 0.1) == good(2)
    assert world.now_s == pytest.approx(0.03)


def test_reading_part_of_an_answer_leaves_the_rest(world):
    world.port.write(instruction(2, *READ_ONE))
    assert world.port.getBytesAvailable() == 15
    assert world.port.read_until(4, 0.0) == good(2)[:4]
    assert world.port.drain() == 11
    assert world.port.read_until(4, 0.0) == b""


def test_a_stall_is_a_gap_in_the_middle(world):
    world.faults.command("stall 2 30 count 1")
    world.port.write(instruction(2, *READ_ONE))
    assert world.port.read_until(99, 0.01) == good(2)[:7]
    assert world.port.read_until(99, 0.1) == good(2)[7:]


def test_truncated(world):
    world.faults.command("truncate 2 9")
    assert world.one() == good(2)[:9]
    assert world.plain() == good(1) + good(2)[:9] + good(3)
    assert len(world.fast()) == 8 + 8 + 9 - 1
    world.faults.clear()
    assert sound(world.fast())


def test_duplicated(world):
    world.faults.command("duplicate 2")
    assert world.one() == good(2) * 2
    assert world.plain() == good(1) + good(2) * 2 + good(3)
    again = world.fast()
    assert again[: len(again) // 2] * 2 == again


def test_a_flipped_bit_is_where_it_was_asked_for(world):
    world.faults.command("corrupt 2 72")
    got = world.one()
    assert got[9] == good(2)[9] ^ 1
    assert not sound(got)


def test_a_dropped_byte(world):
    world.faults.command("drop 2 5 count 1")
    assert world.one() == good(2)[:5] + good(2)[6:]
    world.faults.command("drop 2 -1")
    assert world.one() == good(2)[:-1]


def test_noise_and_loose_headers(world):
    world.faults.command("noise before FFFF count 1")
    world.faults.command("noise after 00FDFD count 1")
    assert world.one() == b"\xff\xff" + good(2) + b"\x00\xfd\xfd"
    world.faults.command("fragment count 1")
    assert world.one() == b"\xff\xff\xfd\x00" + good(2)
    world.faults.command("noise before random count 1")
    assert world.one()[8:] == good(2)
    assert world.one() == good(2)


def test_wrong_id_has_a_right_crc(world):
    world.faults.command("wrong-id 2 9")
    assert world.one() == status(9, 0, good(2)[9:13])
    assert sound(world.fast())


def test_too_short_and_too_long(world):
    world.faults.command("short 2 2 count 1")
    assert world.one() == status(2, 0, good(2)[9:11])
    world.faults.command("long 2 3 count 1")
    assert world.one() == status(2, 0, good(2)[9:13] + bytes(3))


def test_refused(world):
    world.faults.command("refuse 2 7 count 1")
    assert world.one() == status(2, 7, b"")
    world.faults.command("refuse 2 7 count 1")
    block = world.fast()[16:24]
    assert block[:6] == b"\x07\x02" + bytes(4)


def test_colliding_servos_mix_where_they_differ(world):
    world.faults.command("collide 2")
    ping = world.ask(2, 1)
    assert sound(ping)
    assert len(ping) == 14
    mixed = world.one()
    twin = status(2, 0, struct.pack("<i", 2002 + 257))
    assert mixed == bytes(a & b for a, b in zip(good(2), twin, strict=True))
    assert not sound(mixed)
    assert world.one(1) == good(1)


def test_unplugged_until_plugged_and_opened_again(world):
    world.faults.command("unplug")
    for use in (lambda: world.port.write(GOLDEN_PING), world.port.drain):
        with pytest.raises(BusLost, match="gone"):
            use()
    with pytest.raises(PortError, match="No such file"):
        world.port.setBaudRate(1_000_000)
    world.faults.command("plug")
    with pytest.raises(BusLost):
        world.port.read_until(1, 0.0)
    world.port.setBaudRate(1_000_000)
    assert world.one() == good(2)


def test_forbidden_and_blocked(world):
    world.faults.command("deny on")
    with pytest.raises(PortError, match="Permission denied"):
        world.port.setBaudRate(1_000_000)
    world.faults.command("deny off")
    world.faults.command("block on")
    with pytest.raises(BusLost, match="accepts no bytes"):
        world.one()
    assert world.now_s == 0.25
    world.faults.command("block off")
    assert world.one() == good(2)


# The language of faults: durations, reports and refusals


def test_faults_last_for_a_count_a_time_or_until_cleared(world):
    world.faults.command("lose 1 count 2")
    world.faults.command("lose 2 for 1")
    world.faults.command("lose 3")
    assert [world.one(i) for i in IDS] == [b""] * 3
    assert [world.one(i) for i in IDS] == [b""] * 3
    assert world.one(1) == good(1)
    world.now_s = 5.0
    assert world.one(2) == good(2)
    assert world.one(3) == b""
    world.faults.command("clear 3")
    assert world.one(3) == good(3)
    assert not world.faults.wire.has_any


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("lsoe 3", "'lsoe' is not a command; commands: lose, delay"),
        ("lose x", "'x' is not a servo id from 0 to 252"),
        ("delay 3 nan", "'nan' is not milliseconds"),
        ("noise before xyz", "'xyz' is neither random nor bytes in hex"),
        ("set afterwards skip", "unknown; expected after-missing, wrong-baud"),
    ],
)
def test_a_wrong_word_is_named_with_what_would_be_right(world, text, says):
    with pytest.raises(ValueError) as error:
        world.faults.command(text)
    assert says in str(error.value)
    assert not world.faults.wire.has_any

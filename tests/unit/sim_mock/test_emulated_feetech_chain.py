"""The emulated STS bus: the maker's packets, memory, lock, faults and protections."""

import pytest
from servo_bench import PING, FeetechBench

from gazerig.sim_mock.smart_servo.physics import ServoSpec

OVERLOAD = 32


@pytest.fixture
def bench():
    return FeetechBench()


# --- packets

MAKERS = {
    "ping": "FF FF 01 02 01 FB",
    "read": "FF FF 01 04 02 38 02 BE",
    "write": "FF FF 01 09 03 2A 00 08 00 00 E8 03 D5",
    "sync write": "FF FF FE 20 83 2A 06 01 00 08 00 00 E8 03 02 00 08 00 00 E8 03"
    " 03 00 08 00 00 E8 03 04 00 08 00 00 E8 03 58",
}
"""Examples of Feetech's protocol manual."""


def test_the_makers_examples_are_answered_to_the_byte():
    bench = FeetechBench(*[(i, "sts3215", 1304.0) for i in (1, 2, 3, 4)])
    said = [bench.chain.receive(bytes.fromhex(MAKERS[n])) for n in ("ping", "read", "write")]
    assert said[0] == bytes.fromhex("FF FF 01 02 00 FC")
    assert said[1] == bytes.fromhex("FF FF 01 04 00 18 05 DD")
    assert said[2] == bytes.fromhex("FF FF 01 02 00 FC")
    assert bench.read(1, 46, 2) == 1000
    assert bench.chain.receive(bytes.fromhex(MAKERS["sync write"])) == b""
    assert [bench.read(i, 42, 2) for i in (1, 2, 3, 4)] == [2048] * 4


# --- memory


def test_only_what_is_written_while_it_is_open_is_kept(bench):
    bench.write(1, 22, 5)
    bench.write(1, 55, 0)
    bench.write(1, 21, 16)
    bench.write(1, 55, 1)
    bench.write(1, 23, 7)
    bench.chain.faults.command("brown-out 1")
    bench.wait(1.0)
    assert [bench.read(1, at) for at in (21, 22, 23, 55)] == [16, 32, 0, 1]


# --- protections


def jammed():
    """A servo that pushes against something."""
    bench = FeetechBench(ServoSpec(1, "sts3215", 2048))
    bench.enable_torque()
    bench.chain.faults.command("stick 1")
    bench.write(1, 42, 3000, 2)
    return bench


def test_an_overload_lowers_the_torque_after_its_time_until_a_new_goal():
    bench = jammed()
    bench.wait(1.9)
    assert (bench.error(), bench.read(1, 60, 2, 10)) == (0, 1000)
    bench.wait(0.2)
    assert (bench.error(), bench.read(1, 60, 2, 10)) == (OVERLOAD, 200)
    assert bench.read(1, 40) == 1
    bench.chain.faults.command("free 1")
    bench.wait(5.0)
    assert bench.error() == OVERLOAD
    bench.write(1, 42, 2990, 2)
    assert bench.ask(1, PING)[0][1] == 0

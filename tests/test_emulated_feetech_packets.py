"""Packets of the emulated STS servos: the maker's own vectors, framing, signs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from servo_bench import FeetechBench

from gazerig.sim_mock.feetech.packets import FeetechFraming, signed

MAKERS = {
    "ping": "FF FF 01 02 01 FB",
    "read": "FF FF 01 04 02 38 02 BE",
    "write": "FF FF 01 09 03 2A 00 08 00 00 E8 03 D5",
    "sync write": "FF FF FE 20 83 2A 06 01 00 08 00 00 E8 03 02 00 08 00 00 E8 03"
    " 03 00 08 00 00 E8 03 04 00 08 00 00 E8 03 58",
}
"""Examples of Feetech's protocol manual."""


def feed(data, gap_s=0.001):
    return [tuple(found) for found in FeetechFraming(gap_s, 0.0).feed(data, 0.0)]


def test_the_makers_examples_are_answered_to_the_byte():
    bench = FeetechBench((1, "sts3215", 1304.0))
    said = [bench.chain.receive(bytes.fromhex(MAKERS[n])) for n in ("ping", "read", "write")]
    assert said[0] == bytes.fromhex("FF FF 01 02 00 FC")
    assert said[1] == bytes.fromhex("FF FF 01 04 00 18 05 DD")
    assert said[2] == bytes.fromhex("FF FF 01 02 00 FC")
    assert bench.read(1, 42, 2) == 2048
    assert bench.read(1, 46, 2) == 1000


def test_the_makers_sync_write_reaches_all_four():
    bench = FeetechBench(*[(i, "sts3215", 1000.0) for i in (1, 2, 3, 4)])
    assert bench.chain.receive(bytes.fromhex(MAKERS["sync write"])) == b""
    assert [bench.read(i, 42, 2) for i in (1, 2, 3, 4)] == [2048] * 4


@pytest.mark.parametrize("length", [0, 1])
def test_a_length_that_cannot_be_is_passed_over(length):
    bad = bytes((255, 255, 1, length))
    assert len(feed(bad + FeetechBench.instruction(1, 1))) == 1


def test_more_than_two_ff_before_the_id_are_still_a_header():
    assert feed(b"\xff" + FeetechBench.instruction(5, 1)) == [(5, 1, b"", 7)]


@given(st.integers(0, 0xFD), st.sampled_from([2, 3, 4, 5, 6, 8, 10, 11, 0x82, 0x83]), st.data())
def test_random_instructions_never_raise(servo_id, code, data):
    bench = FeetechBench((1, "sts3215", 2048.0), (servo_id, "sts3215", 10.0))
    for _ in range(4):
        params = data.draw(st.binary(max_size=24))
        target = data.draw(st.sampled_from((servo_id, 0xFE)))
        bench.chain.receive(FeetechBench.instruction(target, code, params))
        bench.now_s += 0.5
    assert all(abs(x) < 1e7 for x in bench.chain.positions_steps())


@pytest.mark.parametrize(
    ("raw", "bit", "value"),
    [
        (0x8001, 15, -1),
        (0x7FFF, 15, 32767),
        (0x8000, 15, 0),
        (0x0C00, 11, -1024),
        (0x0464, 10, -100),
    ],
)
def test_signs_stand_in_one_bit(raw, bit, value):
    assert signed(raw, bit) == value

"""Group reads of STS servos taken apart, and which of their values are believed."""

import struct

import pytest

from gazerig.drivers.feetech.feedback import FeetechFeedback
from gazerig.drivers.feetech.group import Group
from gazerig.drivers.feetech.protocol import checksum
from gazerig.drivers.feetech.views import ARMED, SENSED, View, alone_turns, together_turns
from gazerig.drivers.servo_bus.sync_read import Heard, Whole
from gazerig.drivers.types import ServoSetup

BLOCK = struct.pack("<HHHBBBBB2xH", 0x8006, 0x8064, 0x052C, 74, 31, 0, 0x20, 1, 0x8002)


def status(servo_id, params, error=0):
    body = bytes((servo_id, len(params) + 2, error)) + params
    return b"\xff\xff" + body + bytes((checksum(body),))


def test_signs_units_and_both_error_bytes():
    sample = SENSED.sample(0x01, BLOCK)
    assert (sample.position, sample.velocity, sample.load, sample.current) == (-6, -100, -300, -2)
    assert (sample.voltage, sample.temperature, sample.moving) == (74, 31, 1)
    assert sample.error == 0x21
    assert sample.torque is None
    armed = ARMED.sample(0, bytes((1, 50)) + bytes(6) + struct.pack("<H", 400) + bytes(6) + BLOCK)
    assert (armed.torque, armed.acceleration, armed.limit) == (1, 50, 400)
    assert armed[:8] == (0x20, *sample[1:8])


@pytest.mark.parametrize("address", [*range(30, 41), *range(51, 57)])
def test_wherever_a_reading_begins_it_says_the_same(address):
    view = View(address)
    sample = view.sample(0, bytes(view.length - 15) + BLOCK)
    assert sample[:8] == SENSED.sample(0, BLOCK)[:8]
    assert (sample.torque == 0) == (address <= 40)


def test_after_trouble_no_reading_has_the_length_of_the_one_before():
    together, alone = together_turns(8), alone_turns()
    assert [together.next().armed for _ in range(16)] == ([True] + [False] * 7) * 2
    lengths = []
    for k in range(5):
        together.trouble(0.01 * k)
        lengths.append(together.next().length)
    usual = {SENSED.length, ARMED.length}
    assert len(set(lengths)) == 5 and not usual & set(lengths)
    together.calm(0.28)
    assert together.next().length not in usual
    together.calm(0.30)
    assert together.next().length in usual
    others = {alone.next().length for _ in range(10)}
    assert len(others) == 10 and not others & (usual | set(lengths))


def test_a_whole_answer_and_its_pieces_say_the_same():
    group = Group((2, 5), SENSED)
    raw = status(2, BLOCK) + status(5, BLOCK, 4)
    assert group.each(raw, group.whole(raw)) == group.pieces(raw).samples
    assert group.whole(raw[:-1]) is None
    assert group.whole(status(5, BLOCK) + status(2, BLOCK)) is None
    assert group.missing(raw) == 0
    assert group.missing(raw[:30]) == len(raw) - 30


@pytest.mark.parametrize("at", range(42))
def test_any_single_damaged_byte_of_a_whole_answer_is_found(at):
    group = Group((2, 5), SENSED)
    raw = status(2, BLOCK) + status(5, BLOCK)
    assert group.whole(raw) is not None
    assert group.whole(raw[:at] + bytes([raw[at] ^ 0x40]) + raw[at + 1 :]) is None


def test_a_whole_answer_at_once_reads_as_servo_by_servo():
    setups = [ServoSetup(i, "sts3215", 0, 4095, 3000.0) for i in (2, 5)]
    group = Group((2, 5), SENSED)
    for velocity, load, current in ((0x8064, 0x052C, 0x8002), (100, 0x7FF, 7), (0, 0x3FF, 0)):
        block = struct.pack("<HHHBBBBB2xH", 906, velocity, load, 74, 31, 0, 0, 1, current)
        raw = status(2, block) + status(5, block)
        one, other = FeetechFeedback(setups), FeetechFeedback(setups)
        for columns in (one, other):
            columns.expect_torque(True)
            for slot in (0, 1):
                columns.places.place(slot, 900, 0.99)
            assert columns.places.one(0, 900, 1.0) and columns.places.one(1, 900, 1.0)
        whole = Whole(group, raw, group.whole(raw), 1.01)
        each = whole.each()
        assert one.take_whole(whole)
        for k, i in enumerate((2, 5)):
            other.take(k, each[i])
        assert one.feedback() == other.feedback() and one.feedback().missing == ()


def test_twice_the_same_is_an_echo_and_two_that_differ_are_nobodys():
    group = Group((2, 5), SENSED)
    other = bytes(15)
    twice = group.pieces(status(2, BLOCK) * 2 + status(5, BLOCK))
    assert set(twice.samples) == {2, 5} and not twice.damaged
    mixed = group.pieces(status(2, BLOCK) + status(2, other) + status(5, BLOCK))
    assert (set(mixed.samples), mixed.damaged) == ({5}, {2})


def test_an_answer_of_another_length_is_not_the_one_asked_for():
    pieces = Group((2,), SENSED).pieces(status(2, BLOCK + b"\x00"))
    assert (pieces.samples, pieces.damaged) == ({}, {2})


def test_a_place_that_no_joint_can_have_come_to_must_be_said_twice():
    columns = FeetechFeedback([ServoSetup(1, "sts3215", 0, 4095, 3000.0)])

    def believes(position, at_s):
        sample = SENSED.sample(0, struct.pack("<H", position) + BLOCK[2:])
        return columns.believes(0, Heard(sample, at_s))

    assert believes(1000, 0.0)
    assert not believes(3000, 0.01)
    assert believes(1010, 0.02)
    assert not believes(3000, 0.03)
    assert not believes(200, 0.04)
    assert not believes(3000, 0.05)
    assert not believes(2990, 0.06)
    # Three in a row that agree: somebody has turned it by hand.
    assert believes(2980, 0.07)
    # What the motor can do in a second is no leap, nor is anything after a port was gone.
    assert believes(200, 1.07)
    columns.places.forget()
    assert believes(4000, 1.08)

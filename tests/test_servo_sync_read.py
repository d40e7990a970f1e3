"""Sync reads of every family: whole answers at once, damaged ones piece by piece."""

import struct
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.read_plan import DIRECT, FastSyncRead, direct_windows
from gazerig.drivers.feetech.family import FEETECH, window
from gazerig.drivers.feetech.protocol import checksum
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.poll_list import AGAIN_FIRST_S, AGAIN_LAST_S, PollList, silent_servos
from gazerig.drivers.servo_bus.sync_read import ServoReply, SyncRead
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = (4, 1, 9)
PLACES = {4: 1000, 1: 2000, 9: 3000}
BLOCK = struct.pack("<HHHBBBBB2xH", 0x8006, 0x8064, 0x052C, 74, 31, 0, 0x20, 1, 0x8002)
SENSED, ARMED = window(56), window(40)

dynamixel_read = partial(SyncRead, DYNAMIXEL)
feetech_read = partial(SyncRead, FEETECH)

READS: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
    "dynamixel": (dynamixel_read, (DIRECT, *direct_windows()._spare)),
    "dynamixel fast": (FastSyncRead, (DIRECT, *direct_windows()._spare)),
    "feetech": (feetech_read, (SENSED, ARMED, window(55), window(30))),
}


class Kind:
    """A kind of read: how it is made, its windows, and servos that answer it."""

    def __init__(self, name):
        self.name, (self.make, self.windows) = name, READS[name]
        if name == "feetech":
            specs = [ServoSpec(i, "sts3215", PLACES[i]) for i in IDS]
            self.chain: Any = build_feetech(specs, lambda: 0.0)
        else:
            self.chain = build_dynamixel([(i, "xl330-m288", PLACES[i]) for i in IDS], lambda: 0.0)

    def asked(self, number=0):
        """Return a read with one of the windows, and its answer."""
        group = self.make(IDS, self.windows[number])
        return group, self.chain.receive(group.request)


@pytest.fixture(params=READS)
def kind(request):
    return Kind(request.param)


def test_a_whole_answer_is_taken_at_once(kind):
    for number in range(len(kind.windows)):
        group, raw = kind.asked(number)
        assert len(raw) == group.reply_length
        assert group.parse_whole(raw, {})[group.columns.position] == (1000, 2000, 3000)
        assert group.bytes_missing(raw) == 0
        assert {i: a.position for i, a in group.verified_parts(raw).samples.items()} == PLACES


def test_any_single_damaged_byte_is_found_and_costs_little(kind):
    group, raw = kind.asked()
    head = 8 if kind.make is FastSyncRead else 0
    for at in range(len(raw)):
        for flip in (0x01, 0x80, 0xFF):
            bad = raw[:at] + bytes([raw[at] ^ flip]) + raw[at + 1 :]
            assert group.parse_whole(bad, {}) is None
            answers = group.verified_parts(bad).samples
            assert all(answer.position == PLACES[i] for i, answer in answers.items())
            # A damaged CRC of a fast block is also the start of the next block's proof.
            assert len(answers) >= (1 if at >= head else 0)
            if kind.name == "dynamixel":
                assert len(answers) == 2


def test_any_lost_or_added_byte_never_makes_a_wrong_value(kind):
    group, raw = kind.asked()
    for at in range(len(raw)):
        for bad in (raw[:at] + raw[at + 1 :], raw[:at] + b"\xff" + raw[at:], raw[:at]):
            if bad == raw:
                continue
            answers = group.verified_parts(bad).samples
            assert all(answer.position == PLACES[i] for i, answer in answers.items())


def test_a_short_answer_gives_what_it_has(kind):
    group, raw = kind.asked()
    cut = raw[: len(raw) - 5]
    assert group.parse_whole(cut, {}) is None
    assert group.bytes_missing(cut) == 5
    assert set(group.verified_parts(cut).samples) == {4, 1}


def test_an_answer_of_another_reading_is_not_taken(kind):
    _, raw = kind.asked()
    now, _ = kind.asked(1)
    assert now.parse_whole(raw, {}) is None
    assert now.verified_parts(raw).samples == {}


def test_a_proved_block_in_the_place_of_another_s_makes_its_id_doubtful():
    kind = Kind("dynamixel fast")
    for command in ("wrong-id 9 4", "reorder"):
        kind.chain.faults.command(command)
    group, raw = kind.asked()
    # Two servos answer as 4, and the right one is unknown.
    verified_parts = group.verified_parts(raw)
    assert {i: a.position for i, a in verified_parts.samples.items()} == {1: PLACES[1]}
    assert 4 in verified_parts.damaged


def test_stuffed_answers_are_longer_and_understood():
    everyday = struct.pack("<hii", -1, -3, 2000)
    group = dynamixel_read(IDS, DIRECT)
    raw = b"".join(status(i, 0, everyday if i == 1 else bytes(10)) for i in IDS)
    assert everyday[:3] + b"\xfd" in raw
    assert group.parse_whole(raw, {}) is None
    assert group.bytes_missing(raw[: group.reply_length]) == 1
    sample = group.verified_parts(raw).samples[1]
    assert (sample.effort, sample.velocity, sample.position) == (-1, -3, 2000)


def test_a_refusal_without_bytes_is_an_answer_with_its_error():
    group = dynamixel_read((1,), DIRECT)
    assert group.verified_parts(status(1, 0x87, b"")).samples[1].error == 0x87
    assert group.verified_parts(status(1, 0x80, b"")).samples == {}


# --- numbers with an own sign, windows with more values


def sts_status(servo_id, params, error=0):
    body = bytes((servo_id, len(params) + 2, error)) + params
    return b"\xff\xff" + body + bytes((checksum(body),))


def test_signs_units_and_both_error_bytes():
    sample = SENSED.sample(0x01, BLOCK)
    assert (sample.position, sample.velocity, sample.effort) == (-6, -100, -300)
    assert (sample.voltage, sample.temperature) == (74, 31)
    assert (sample.error, sample.status) == (0x01, 0x20)
    assert sample.torque is None
    armed = ARMED.sample(0, bytes((1, 50)) + bytes(6) + struct.pack("<H", 400) + bytes(6) + BLOCK)
    assert (armed.torque, armed.acceleration, armed.torque_limit) == (1, 50, 400)
    assert armed[1:4] == sample[1:4] and armed.status == sample.status


def test_after_trouble_no_reading_has_the_length_of_the_one_before():
    plan = FEETECH.read_plan([], None)
    together, alone = plan.group_windows, plan.single_windows
    tells = ["torque" in together.next_window().fields for _ in range(16)]
    assert tells == ([True] + [False] * 7) * 2
    lengths = []
    for k in range(5):
        together.record_trouble(0.01 * k)
        lengths.append(together.next_window().length)
    usual = {SENSED.length, ARMED.length}
    assert len(set(lengths)) == 5 and not usual & set(lengths)
    together.end_trouble(0.28)
    assert together.next_window().length not in usual
    together.end_trouble(0.30)
    assert together.next_window().length in usual
    others = {alone.next_window().length for _ in range(10)}
    assert len(others) == 10 and not others & (usual | set(lengths))


@pytest.mark.parametrize("header", [b"\xff\x00", b"\xff\xff"])
def test_an_answer_in_the_place_of_another_servo_s_is_not_believed_where_one_is_missing(header):
    """Servo 2 answers as its neighbour 5, whose own answer arrives damaged."""
    group = feetech_read((2, 5, 9), SENSED)
    lost, last = sts_status(5, bytes(15)), sts_status(9, BLOCK)
    some = group.verified_parts(sts_status(5, BLOCK) + header + lost[2:-1] + b"\x01" + last)
    assert set(some.samples) == {9} and some.has_stray_bytes
    assert 5 in some.damaged | some.unverifiable
    # The same behind an echo of the question; whole answers may come in any order.
    assert set(group.verified_parts(group.request + sts_status(2, BLOCK)).samples) == {2}
    whole = group.verified_parts(last + sts_status(5, BLOCK) + sts_status(2, BLOCK))
    assert set(whole.samples) == {2, 5, 9} and not whole.has_stray_bytes
    assert not group.verified_parts(sts_status(2, BLOCK)).has_stray_bytes


def test_twice_the_same_is_an_echo_and_two_that_differ_are_nobodys():
    group = feetech_read((2, 5), SENSED)
    other = bytes(15)
    twice = group.verified_parts(sts_status(2, BLOCK) * 2 + sts_status(5, BLOCK))
    assert set(twice.samples) == {2, 5} and not twice.damaged
    mixed = group.verified_parts(sts_status(2, BLOCK) + sts_status(2, other) + sts_status(5, BLOCK))
    assert (set(mixed.samples), mixed.damaged) == ({5}, {2})


# --- what values become, and which are believed


def columns_of(family, model, *ids, **limits):
    """Return the columns of some servos that are under torque."""
    setups = [ServoConfig(i, model, 0, 4095, 3000.0, **limits) for i in ids]
    columns = FeedbackColumns(family, setups)
    columns.expect_torque(True)
    return columns


def both_ways(group, raw, *columns):
    """Apply an answer as a whole to the first columns, servo by servo to the second."""
    one, other = columns
    for each in columns:
        for slot in range(len(group.ids)):
            each.places.record(slot, 900, 0.99)
            assert each.places.is_plausible(slot, 900, 1.0)
    taken, each = one.apply_whole(group, raw, 1.01), group.verified_parts(raw).samples
    for slot, servo_id in enumerate(group.ids):
        other.apply_reply(slot, ServoReply(each[servo_id], 1.01))
    return taken


@pytest.mark.parametrize("velocity, load", [(0x8064, 0x052C), (100, 0x7FF), (0, 0x3FF)])
@pytest.mark.parametrize("view", [SENSED, ARMED])
def test_a_whole_answer_at_once_reads_as_servo_by_servo(view, velocity, load):
    group = feetech_read((2, 5), view)
    block = struct.pack("<HHHBBBBB2xH", 906, velocity, load, 74, 31, 0, 0, 1, 7)
    armed = bytes((1, 0)) + bytes(6) + struct.pack("<H", 1000) + bytes(6) if view is ARMED else b""
    raw = sts_status(2, armed + block) + sts_status(5, armed + block)
    columns = [columns_of(FEETECH, "sts3215", 2, 5) for _ in range(2)]
    assert both_ways(group, raw, *columns)
    assert columns[0].now == columns[1].now
    assert columns[0].now.missing == ()


@pytest.mark.parametrize(
    ("torque", "acceleration", "limit", "error", "status_bits", "warm", "taken"),
    [
        (1, 0, 400, 0, 0, 31, True),
        (0, 0, 400, 0, 0, 31, False),
        (1, 50, 400, 0, 0, 31, False),
        (1, 0, 1000, 0, 0, 31, False),
        (1, 0, 400, 0x20, 0, 31, False),
        (1, 0, 400, 0, 0x04, 31, False),
        (1, 0, 400, 0, 0, 200, False),
    ],
)
def test_an_answer_in_which_anything_is_amiss_is_looked_at(
    torque, acceleration, limit, error, status_bits, warm, taken
):
    group = feetech_read((2, 5), ARMED)
    block = struct.pack("<HHHBBBBB2xH", 906, 0, 0, 74, warm, 0, status_bits, 0, 0)
    well = bytes((1, 0)) + bytes(6) + struct.pack("<H", 400) + bytes(6)
    armed = bytes((torque, acceleration)) + bytes(6) + struct.pack("<H", limit) + bytes(6)
    calm = struct.pack("<HHHBBBBB2xH", 906, 0, 0, 74, 31, 0, 0, 0, 0)
    raw = sts_status(2, well + calm) + sts_status(5, armed + block, error)
    columns = [columns_of(FEETECH, "sts3215", 2, 5, strength=0.4) for _ in range(2)]
    assert both_ways(group, raw, *columns) == taken


# --- queried servos


@pytest.mark.parametrize(
    ("heard", "blamed"),
    [
        ((), (4,)),
        ((4, 1), (9,)),
        ((1, 9), (4,)),
        ((1,), (4, 9)),
    ],
)
def test_only_those_who_kept_silent_themselves_are_blamed(heard, blamed):
    assert silent_servos(IDS, heard) == blamed


def test_a_silent_servo_is_asked_at_once_then_ever_more_seldom():
    polled = PollList(IDS)
    now_s = 10.0
    polled.record_silent(1, now_s)
    assert (polled.group, polled.next_due(now_s)) == ((4, 9), 1)
    waits = []
    for _ in range(6):
        polled.record_silent(1, now_s)
        start_s = now_s
        while polled.next_due(now_s) is None:
            now_s += AGAIN_FIRST_S / 4
        waits.append(now_s - start_s)
    assert waits == [0.0625, 0.125, 0.25, 0.5, 0.5, AGAIN_LAST_S]
    assert polled.record_answer(1)
    assert (polled.group, polled.is_troubled) == (IDS, False)
    assert not polled.record_answer(1)


def test_where_all_are_out_somebody_is_always_asked_and_one_answer_calls_all_back():
    polled = PollList(IDS)
    for servo_id in IDS:
        polled.record_silent(servo_id, 1.0)
        polled.record_silent(servo_id, 1.0)
    assert polled.group == ()
    assert polled.next_due(1.0) == 4
    polled.record_silent(4, 1.0)
    assert polled.next_due(1.0) == 1
    assert polled.record_answer(1)
    assert (polled.group, polled.next_due(1.0)) == (IDS, None)


def test_damage_three_times_in_a_row_takes_a_servo_out():
    polled = PollList(IDS)
    for _ in range(2):
        polled.record_damaged(9, 0.0)
    polled.record_answer(9)
    for _ in range(2):
        polled.record_damaged(9, 0.0)
    assert polled.group == IDS
    polled.record_damaged(9, 0.0)
    assert polled.group == (4, 1)

"""Group reads: whole answers at once, damaged ones piece by piece."""

import struct

import pytest

from gazerig.drivers.dynamixel.read_windows import DIRECT, direct_turns
from gazerig.drivers.dynamixel.sync_packets import FastGroup, PlainGroup
from gazerig.drivers.servo_bus.poll_list import AGAIN_FIRST_S, AGAIN_LAST_S, Roll, silent_ones
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status

IDS = (4, 1, 9)
PLACES = {4: 1000, 1: 2000, 9: 3000}


def chain():
    return build_dynamixel([(i, "xl330-m288", PLACES[i]) for i in IDS], lambda: 0.0)


@pytest.fixture(params=[PlainGroup, FastGroup], ids=["plain", "fast"])
def kind(request):
    return request.param


VIEWS = (DIRECT, *direct_turns()._spare)


@pytest.mark.parametrize("view", VIEWS)
def test_a_whole_answer_is_taken_at_once(kind, view):
    group = kind(IDS, view)
    raw = chain().receive(group.request)
    assert len(raw) == group.reply_length
    assert group.whole(raw)[group.columns.position] == (1000, 2000, 3000)
    assert group.missing(raw) == 0
    assert {i: a.position for i, a in group.pieces(raw).samples.items()} == PLACES


def test_any_single_damaged_byte_is_found_and_costs_little(kind):
    group = kind(IDS, DIRECT)
    raw = chain().receive(group.request)
    head = 8 if kind is FastGroup else 0
    for at in range(len(raw)):
        for flip in (0x01, 0x80, 0xFF):
            bad = raw[:at] + bytes([raw[at] ^ flip]) + raw[at + 1 :]
            assert group.whole(bad) is None
            answers = group.pieces(bad).samples
            assert all(answer.position == PLACES[i] for i, answer in answers.items())
            # A damaged CRC of a fast block is also the start of the next block's proof.
            assert len(answers) >= (1 if at >= head else 0)
            if kind is PlainGroup:
                assert len(answers) == 2


def test_any_lost_or_added_byte_never_makes_a_wrong_value(kind):
    group = kind(IDS, DIRECT)
    raw = chain().receive(group.request)
    for at in range(len(raw)):
        for bad in (raw[:at] + raw[at + 1 :], raw[:at] + b"\xff" + raw[at:], raw[:at]):
            if bad == raw:
                continue
            answers = group.pieces(bad).samples
            assert all(answer.position == PLACES[i] for i, answer in answers.items())


def test_a_short_answer_gives_what_it_has(kind):
    group = kind(IDS, DIRECT)
    raw = chain().receive(group.request)
    cut = raw[: len(raw) - 5]
    assert group.whole(cut) is None
    assert group.missing(cut) == 5
    assert set(group.pieces(cut).samples) == {4, 1}


def test_an_answer_of_another_reading_is_not_taken(kind):
    late, now = kind(IDS, DIRECT), kind(IDS, VIEWS[1])
    raw = chain().receive(late.request)
    assert now.whole(raw) is None
    assert now.pieces(raw).samples == {}


def test_noise_before_the_answer_does_no_harm(kind):
    group = kind(IDS, DIRECT)
    raw = b"\xff\xff\xfd\x00" + chain().receive(group.request)
    assert {i: a.position for i, a in group.pieces(raw).samples.items()} == PLACES


def test_stuffed_answers_are_longer_and_understood():
    everyday = struct.pack("<hii", -1, -3, 2000)
    group = PlainGroup(IDS, DIRECT)
    raw = b"".join(status(i, 0, everyday if i == 1 else bytes(10)) for i in IDS)
    assert everyday[:3] + b"\xfd" in raw
    assert group.whole(raw) is None
    assert group.missing(raw[: group.reply_length]) == 1
    assert group.pieces(raw).samples[1][:4] == (0, -1, -3, 2000)


def test_a_refusal_without_bytes_is_an_answer_with_its_error():
    group = PlainGroup((1,), DIRECT)
    assert group.pieces(status(1, 0x87, b"")).samples[1].error == 0x87
    assert group.pieces(status(1, 0x80, b"")).samples == {}


@pytest.mark.parametrize(
    ("heard", "blamed"),
    [
        ((4, 1, 9), ()),
        ((), (4,)),
        ((4,), (1,)),
        ((4, 1), (9,)),
        ((1, 9), (4,)),
        ((9,), (4, 1)),
        ((1,), (4, 9)),
    ],
)
def test_only_those_who_kept_silent_themselves_are_blamed(heard, blamed):
    assert silent_ones(IDS, heard) == blamed


def test_a_silent_servo_is_asked_at_once_then_ever_more_seldom():
    roll = Roll(IDS)
    now_s = 10.0
    roll.silent(1, now_s)
    assert (roll.group, roll.due(now_s)) == ((4, 9), 1)
    waits = []
    for _ in range(6):
        roll.silent(1, now_s)
        start_s = now_s
        while roll.due(now_s) is None:
            now_s += AGAIN_FIRST_S / 4
        waits.append(now_s - start_s)
    assert waits == [0.0625, 0.125, 0.25, 0.5, 0.5, AGAIN_LAST_S]
    assert roll.answered(1)
    assert (roll.group, roll.troubled) == (IDS, False)
    assert not roll.answered(1)


def test_where_all_are_out_somebody_is_always_asked_and_one_answer_calls_all_back():
    roll = Roll(IDS)
    for servo_id in IDS:
        roll.silent(servo_id, 1.0)
        roll.silent(servo_id, 1.0)
    assert roll.group == ()
    assert roll.due(1.0) == 4
    roll.silent(4, 1.0)
    assert roll.due(1.0) == 1
    assert roll.answered(1)
    assert (roll.group, roll.due(1.0)) == (IDS, None)


def test_damage_three_times_in_a_row_takes_a_servo_out():
    roll = Roll(IDS)
    for _ in range(2):
        roll.damaged(9, 0.0)
    roll.answered(9)
    for _ in range(2):
        roll.damaged(9, 0.0)
    assert roll.group == IDS
    roll.damaged(9, 0.0)
    assert roll.group == (4, 1)


def test_several_out_take_turns():
    roll = Roll(IDS)
    roll.silent(4, 1.0)
    roll.silent(9, 1.1)
    assert roll.due(2.0) == 4
    roll.silent(4, 2.0)
    assert roll.due(2.0) == 9

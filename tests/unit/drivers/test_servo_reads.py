"""Reads of every family: whole answers at once, damaged ones servo by servo, and their feedback."""

import struct
from typing import Any

import pytest

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.protocol import checksum
from gazerig.drivers.servo_bus.feedback import FeedbackColumns
from gazerig.drivers.servo_bus.poll_list import silent_servos
from gazerig.drivers.servo_bus.sync_read import GroupRead
from gazerig.drivers.servo_bus.transaction import sort_answers
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = (4, 1, 9)
PLACES = {4: 1000, 1: 2000, 9: 3000}
WINDOW = DYNAMIXEL.window


class Kind:
    """A read of three servos of a kind, and servos that answer it."""

    def __init__(self, name):
        self.family = FEETECH if name == "feetech" else DYNAMIXEL
        if name == "feetech":
            self.chain: Any = build_feetech(
                [ServoSpec(i, "sts3215", PLACES[i]) for i in IDS], lambda: 0.0
            )
        else:
            self.chain = build_dynamixel([(i, "xl330-m288", PLACES[i]) for i in IDS], lambda: 0.0)
        self.group = GroupRead(self.family, IDS, self.family.window, name == "dynamixel fast")
        self.raw = self.chain.receive(self.group.request)

    def positions(self, raw):
        """Return the positions in an answer that is taken servo by servo."""
        group = self.group
        good, _ = sort_answers(group.parse(raw), IDS, group.length, self.family.codec.REFUSAL)
        return {i: group.reply(answer, 1.0).values["position"] for i, answer in good.items()}


@pytest.fixture(params=["dynamixel", "dynamixel fast", "feetech"])
def kind(request):
    return Kind(request.param)


def test_a_whole_answer_is_taken_at_once_and_one_of_another_length_is_not(kind):
    assert len(kind.raw) == kind.group.reply_length
    assert kind.group.parse_whole(kind.raw)[kind.group.columns[0]] == (1000, 2000, 3000)
    assert kind.positions(kind.raw) == PLACES
    window = kind.family.window
    longer = window._replace(
        address=window.address - 1, layout=f"{window.layout[0]}x{window.layout[1:]}"
    )
    other = GroupRead(kind.family, IDS, longer, "fast" in str(kind.group.parse))
    assert other.parse_whole(kind.raw) is None
    good, _ = sort_answers(other.parse(kind.raw), IDS, other.length, 0)
    assert not good


def test_any_damaged_lost_or_added_byte_never_makes_a_wrong_value(kind):
    raw = kind.raw
    for at in range(len(raw)):
        for flip in (0x01, 0x80, 0xFF):
            bad = raw[:at] + bytes([raw[at] ^ flip]) + raw[at + 1 :]
            assert kind.group.parse_whole(bad) is None
            found = kind.positions(bad)
            assert all(PLACES[i] == steps for i, steps in found.items())
            # The header of a fast answer is that of all servos.
            assert found or at < 8
        for bad in (raw[:at] + raw[at + 1 :], raw[:at] + b"\xff" + raw[at:], raw[:at]):
            if bad != raw:
                assert all(PLACES[i] == steps for i, steps in kind.positions(bad).items())


def test_stuffed_answers_and_refusals_are_understood():
    everyday = struct.pack("<hii", -1, -3, 2000)
    group = GroupRead(DYNAMIXEL, IDS, WINDOW)
    raw = b"".join(status(i, 0, everyday if i == 1 else bytes(10)) for i in IDS)
    assert everyday[:3] + b"\xfd" in raw and group.parse_whole(raw) is None
    good, _ = sort_answers(group.parse(raw), IDS, 10, 0x7F)
    reply = group.reply(good[1], 1.0)
    assert (reply.error, reply.values) == (0, {"effort": -1, "velocity": -3, "position": 2000})
    good, _ = sort_answers(group.parse(status(1, 0x87, b"")), IDS, 10, 0x7F)
    reply = group.reply(good[1], 1.0)
    assert (reply.error, reply.values) == (0x87, {})
    assert not sort_answers(group.parse(status(1, 0x80, b"")), IDS, 10, 0x7F)[0]


def sts_status(servo_id, params, error=0):
    body = bytes((servo_id, len(params) + 2, error)) + params
    return b"\xff\xff" + body + bytes((checksum(body),))


def test_twice_the_same_is_an_echo_and_two_that_differ_are_nobodys():
    group = GroupRead(FEETECH, (2, 5), FEETECH.window)
    one, other = sts_status(2, bytes(10)), sts_status(2, bytes(9) + b"\1")
    five = sts_status(5, bytes(10))
    good, damaged = sort_answers(group.parse(one * 2 + five), (2, 5), 10, 0)
    assert set(good) == {2, 5} and not damaged
    good, damaged = sort_answers(group.parse(one + other + five), (2, 5), 10, 0)
    assert (set(good), damaged) == ({5}, {2})


# --- feedback


def sts_answer(*positions, velocity=0, load=0, error=0, bits=0, warm=31):
    """Return an answer of STS servos 1, 2 ...; words have separate sign bits."""
    # Only the first one pushes.
    loads = load, *[0] * len(positions)
    params = [
        struct.pack("<HHHBBxB", *moved, 74, warm, bits)
        for moved in zip(positions, [velocity] * len(positions), loads, strict=False)
    ]
    return b"".join(sts_status(i, data, error) for i, data in enumerate(params, 1))


def both_ways(raw, count=2):
    """Return the feedback of an answer at once, None if it is not taken, and servo by servo."""
    setups = [ServoConfig(i, "sts3215", 0, 4095, 3000.0) for i in range(1, count + 1)]
    ids = tuple(setup.id for setup in setups)
    group, whole, single = (
        GroupRead(FEETECH, ids, FEETECH.window),
        *(FeedbackColumns(FEETECH, setups) for _ in range(2)),
    )
    for servo_id, answer in sort_answers(group.parse(raw), ids, group.length, 0)[0].items():
        for columns in (single, whole):
            assert columns.apply_reply(servo_id - 1, group.reply(answer, 1.01))
    taken = whole.apply_whole(group, raw, 1.01)
    return (whole.now if taken else None), single.now


@pytest.mark.parametrize(("velocity", "load"), [(0x8064, 0x052C), (100, 0x7FF), (0, 0x3FF)])
def test_positions_beyond_a_turn_read_as_the_servo_reports_them(velocity, load):
    """4368 is beyond the end of the turn, 0x8064 is -100."""
    whole, single = both_ways(sts_answer(4368, 0x8064, velocity=velocity, load=load))
    assert whole == single
    assert whole.position_steps == (4368, -100) and whole.missing == ()
    assert whole.velocity_steps_s[0] == (-100.0 if velocity & 0x8000 else velocity)
    assert whole.temperature_c == (31, 31)


@pytest.mark.parametrize("amiss", [{"error": 0x20}, {"bits": 0x04}, {"warm": 200}])
def test_an_answer_in_which_anything_is_amiss_is_looked_at(amiss):
    assert both_ways(sts_answer(906, 906, **amiss))[0] is None


# --- silent servos


@pytest.mark.parametrize(
    ("heard", "blamed"), [((), (4,)), ((4, 1), (9,)), ((1, 9), (4,)), ((1,), (4, 9))]
)
def test_only_those_who_kept_silent_themselves_are_blamed(heard, blamed):
    assert silent_servos(IDS, heard) == blamed

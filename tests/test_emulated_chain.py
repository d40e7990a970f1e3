"""What every emulated chain of servos does, whatever its make: framing, groups, ids, faults."""

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest
import sts_bench
from fastcrc.crc16 import umts
from hypothesis import given
from hypothesis import strategies as st

from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech

ALL = 0xFE


@dataclass(frozen=True)
class Make:
    """One make of servos: how its chain is built, and its instructions as bytes."""

    name: str
    model: str
    build: Callable[..., Any]
    ping: Callable[[int], bytes]
    read_position: Callable[[int], bytes]
    read_group: Callable[..., bytes]
    write_group: Callable[[int, int], bytes]
    torque: Callable[[int], bytes]
    goal: Callable[[int, int], bytes]
    intact: Callable[[bytes], bool]
    answer_size: int
    highest_id: int
    factory_baud: int

    def __str__(self) -> str:
        return self.name


def protocol_2(servo_id: int, code: int, params: bytes = b"") -> bytes:
    packet = b"\xff\xff\xfd\x00" + struct.pack("<BHB", servo_id, len(params) + 3, code) + params
    return packet + struct.pack("<H", umts(packet))


def crc_fits(answer: bytes) -> bool:
    return umts(answer[:-2]) == int.from_bytes(answer[-2:], "little")


DYNAMIXEL = Make(
    name="dynamixel",
    model="xl330-m288",
    build=build_dynamixel,
    ping=lambda i: protocol_2(i, 1),
    read_position=lambda i: protocol_2(i, 2, struct.pack("<HH", 132, 4)),
    read_group=lambda *ids: protocol_2(ALL, 0x82, struct.pack("<HH", 132, 4) + bytes(ids)),
    write_group=lambda i, steps: protocol_2(ALL, 0x83, struct.pack("<HHBi", 116, 4, i, steps)),
    torque=lambda i: protocol_2(i, 3, struct.pack("<HB", 64, 1)),
    goal=lambda i, steps: protocol_2(i, 3, struct.pack("<Hi", 116, steps)),
    intact=crc_fits,
    answer_size=14,
    highest_id=252,
    factory_baud=57_600,
)
FEETECH = Make(
    name="feetech",
    model="sts3215",
    build=build_feetech,
    ping=lambda i: sts_bench.instruction(i, 1),
    read_position=lambda i: sts_bench.instruction(i, 2, 56, 2),
    read_group=lambda *ids: sts_bench.instruction(ALL, 0x82, 56, 2, *ids),
    write_group=lambda i, steps: sts_bench.instruction(
        ALL, 0x83, 42, 2, i, steps.to_bytes(2, "little")
    ),
    torque=lambda i: sts_bench.instruction(i, 3, 40, 1),
    goal=lambda i, steps: sts_bench.instruction(i, 3, 42, steps.to_bytes(2, "little")),
    intact=lambda answer: sum(answer[2:]) % 256 == 255,
    answer_size=6,
    highest_id=253,
    factory_baud=1_000_000,
)
MAKES = (DYNAMIXEL, FEETECH)


@pytest.fixture(params=MAKES, ids=str)
def make(request):
    return request.param


class Bench:
    """A chain of one make with a clock that is set by hand."""

    def __init__(self, make: Make, ids=(1,), **options) -> None:
        self.make = make
        self.now_s = 0.0
        specs = [(i, make.model, 1000.0 * i) for i in ids]
        self.chain = make.build(specs, lambda: self.now_s, **options)

    def ask(self, packet: bytes, baud: int | None = None) -> bytes:
        return self.chain.receive(packet, baud)

    def pings(self, servo_id: int, baud: int | None = None) -> bool:
        return len(self.ask(self.make.ping(servo_id), baud)) == self.make.answer_size

    def answered(self, *ids: int) -> list:
        """Return the pieces that a group read of the position is answered with."""
        replies = self.chain.exchange(self.make.read_group(*ids))
        return [piece for reply in replies for piece in reply.pieces]

    def goals(self) -> list[int]:
        return [servo.memory.get("goal_position") for servo in self.chain.servos]


# --- framing


@pytest.mark.parametrize("noise", [b"\x00", b"\xff", b"\xff\xff\xfd\x00", b"U" * 40], ids=repr)
def test_noise_before_an_instruction_is_passed_over(make, noise):
    bench = Bench(make)
    bench.ask(noise)
    bench.now_s = 0.01
    assert bench.pings(1)
    assert bench.ask(b"U\x00" + make.ping(1)) != b""


def test_an_instruction_may_arrive_byte_by_byte(make):
    bench = Bench(make)
    answers = [bench.ask(bytes([byte])) for byte in make.ping(1)]
    assert not any(answers[:-1])
    assert len(answers[-1]) == make.answer_size


def test_a_torn_instruction_is_forgotten_after_the_gap(make):
    bench, ping = Bench(make), make.ping(1)
    bench.ask(ping[:5])
    bench.now_s = 0.002
    assert bench.ask(ping[5:]) == b""
    assert bench.pings(1)
    bench.chain.choose("packet-gap-ms", "50")
    bench.ask(ping[:5])
    bench.now_s = 0.04
    assert len(bench.ask(ping[5:])) == make.answer_size


def test_a_damaged_instruction_is_met_with_silence_and_the_next_is_heard(make):
    ping = make.ping(1)
    for at in range(2, len(ping)):
        bench = Bench(make, (0, 1))
        assert bench.ask(ping[:at] + bytes([ping[at] ^ 1]) + ping[at + 1 :]) == b"", at
        bench.now_s = 0.01
        assert bench.pings(1)


def test_two_instructions_in_one_piece_are_both_answered_where_they_end(make):
    ping = make.ping(1)
    replies = Bench(make).chain.exchange(ping + ping)
    assert [reply.end for reply in replies] == [len(ping), 2 * len(ping)]


# --- groups


def test_a_group_answers_in_the_order_asked(make):
    assert [piece.servo_id for piece in Bench(make, (1, 2, 3)).answered(3, 1, 2)] == [3, 1, 2]


@pytest.mark.parametrize(
    ("policy", "ids", "waits"),
    [
        ("silence", [1], [0.0]),
        ("skip", [1, 2, 3], [0.0, 0.0, 0.0]),
        ("timeout", [1, 2, 3], [0.0, 0.008, 0.0]),
    ],
)
def test_what_comes_behind_a_missing_one(make, policy, ids, waits):
    bench = Bench(make, (1, 2, 3))
    bench.chain.choose("after-missing", policy)
    bench.chain.choose("slot-timeout-ms", "4")
    pieces = bench.answered(1, 8, 9, 2, 3)
    assert [piece.servo_id for piece in pieces] == ids
    assert [piece.late_s for piece in pieces] == waits


def test_a_silent_servo_is_a_missing_one(make):
    bench = Bench(make, (1, 2, 3))
    bench.chain.faults.command("lose 2")
    assert [piece.servo_id for piece in bench.answered(1, 2, 3)] == [1]


def test_a_group_write_reaches_those_it_names_and_may_be_lost(make):
    bench = Bench(make, (1, 2))
    bench.chain.faults.command("lose-writes 1")
    before = bench.goals()
    assert bench.ask(make.write_group(2, 1700)) == b""
    assert bench.goals() == before
    assert bench.ask(make.write_group(2, 1700)) == b""
    assert bench.goals() == [before[0], 1700]


# --- who listens


def test_servos_with_one_id_mix_their_answers_and_all_obey(make):
    bench = Bench(make)
    for count in (2, 3):
        assert bench.chain.faults.command("collide 1") == "two servos have id 1 now"
        assert bench.pings(1)
        assert not make.intact(bench.ask(make.read_position(1)))
        bench.ask(make.write_group(1, 1500 + count))
        assert bench.goals() == [1500 + count] * count


def test_only_a_client_at_the_servos_baud_rate_is_heard(make):
    bench = Bench(make, baud=500_000 if make is FEETECH else 2_000_000)
    own = bench.chain[1].baud
    assert bench.ask(make.ping(1), 115_200) == b""
    assert bench.pings(1, own)
    bench.chain.choose("wrong-baud", "garbage")
    assert 0 < len(bench.ask(make.ping(1), 115_200)) < make.answer_size
    bench.chain.choose("baud", "any")
    assert bench.pings(1, 115_200)


def test_reset_makes_it_as_from_the_factory(make):
    bench = Bench(make, (5, 6), baud=500_000 if make is FEETECH else 2_000_000)
    set_to = bench.chain[5].baud
    rate = f"id 1, {make.factory_baud} bit/s"
    assert rate in bench.chain.faults.command("reset 5")
    bench.now_s = 1.0
    assert bench.chain.ids() == (1, 6)
    assert not bench.pings(1, set_to)
    assert bench.pings(1, make.factory_baud)
    assert bench.pings(6, set_to)


# --- what servos suffer


def test_a_brown_out_is_deafness_then_a_servo_without_torque(make):
    bench = Bench(make)
    bench.ask(make.torque(1))
    assert bench.chain[1].torque
    bench.chain.faults.command("brown-out 1")
    assert not bench.pings(1)
    bench.now_s = 1.0
    assert bench.pings(1)
    assert not bench.chain[1].torque


def test_a_supply_that_breaks_down_restarts_it_again_and_again(make):
    bench = Bench(make)
    bench.ask(make.torque(1))
    rated = bench.chain[1].supply_v
    bench.chain.faults.command("voltage 1 1.5")
    for bench.now_s in (0.1 * k for k in range(1, 50)):
        assert not bench.pings(1)
    bench.chain.faults.command(f"voltage 1 {rated}")
    bench.now_s = 6.0
    assert bench.pings(1)
    assert not bench.chain[1].torque


def test_a_load_turns_a_limp_joint_and_all_means_all(make):
    bench = Bench(make, (1, 2))
    before = bench.chain.positions_steps()
    bench.chain.faults.command("load all 0.4")
    bench.now_s = 0.2
    for was, place in zip(before, bench.chain.positions_steps(), strict=True):
        assert place > was + 50


def test_status_tells_everything_as_json(make):
    bench = Bench(make)
    bench.ask(make.torque(1))
    bench.ask(make.goal(1, 1100))
    bench.chain.faults.command("lose 1")
    told = json.loads(bench.chain.faults.command("status"))
    assert told["faults"] == ["lose 1"]
    assert told["servos"] == [
        {
            "id": 1, "model": make.model, "position": 1000, "goal": 1100, "torque": 1, "error": 0,
            "temperature_c": 30, "voltage_01v": 50 if make is DYNAMIXEL else 74,
        }
    ]  # fmt: skip
    bench.chain.faults.command("overload 1")
    told = json.loads(bench.chain.faults.command("status"))
    assert told["servos"][0]["error"] == 0x20


# --- the line and its adapter


def test_answers_can_be_late_and_out_of_order(make):
    bench = Bench(make, (1, 2, 3))
    bench.chain.faults.command("delay 2 7 count 1")
    bench.chain.faults.command("reorder count 1")
    pieces = bench.answered(1, 2, 3)
    assert [piece.servo_id for piece in pieces] == [3, 2, 1]
    assert [piece.late_s for piece in pieces] == [0.0, 0.007, 0.0]


def test_echo_and_babble(make):
    bench, ping = Bench(make), make.ping(1)
    bench.chain.faults.command("echo")
    assert bench.ask(ping).startswith(ping)
    bench.chain.faults.command("echo off")
    bench.chain.faults.command("babble")
    bench.now_s = 0.02
    assert bench.ask(b"").startswith(ping[:2])


@pytest.mark.parametrize("fault", ["unplug", "deny", "block"])
def test_faults_of_the_adapter_are_told_to_the_port(make, fault):
    bench = Bench(make)
    bench.chain.faults.command(f"{fault} for 0.5")
    assert bench.chain.faults.on(fault)
    bench.now_s = 0.6
    assert not bench.chain.faults.on(fault)


# --- as text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("explode 1", "'explode' is no command; there is lose"),
        ("overload 9", "overload: no servo 9; there is 1; usage: overload ID"),
        ("voltage 1 99", "'99' is not volts from 0 to 30"),
        ("turn 254 1", "'254' is not a servo id from 0 to HIGHEST"),
        ("set after-missing wait", "after-missing 'wait': it can be silence, skip, timeout"),
        ("set colour red", "set 'colour': unknown; there is after-missing"),
        ("set packet-gap-ms soon", "not a number of milliseconds"),
        ("set baud 1000000", "it can be heed, any"),
    ],
)
def test_what_cannot_be_asked(make, text, message):
    with pytest.raises(ValueError, match=message.replace("HIGHEST", str(make.highest_id))):
        Bench(make).chain.faults.command(text)


def test_help_names_what_can_be_chosen(make):
    told = Bench(make).chain.faults.command("help")
    cases = ["after-missing silence|skip|timeout", "slot-timeout-ms MS", "brown-out ID"]
    own = "overload-ends" if make is FEETECH else "stuffing accept|strict"
    for case in (*cases, own):
        assert case in told


# --- two clocks, one result


@given(st.sampled_from(MAKES), st.lists(st.floats(0.0005, 0.05), min_size=1, max_size=30))
def test_what_is_answered_does_not_depend_on_how_often_one_looks(make, steps):
    often, seldom = Bench(make), Bench(make)
    for bench in (often, seldom):
        bench.ask(make.torque(1))
        bench.ask(make.goal(1, 2500))
    for step in steps:
        often.now_s += step
        often.ask(make.read_position(1))
    seldom.now_s = often.now_s
    assert often.ask(make.read_position(1)) == seldom.ask(make.read_position(1))
    assert often.chain.positions_steps() == seldom.chain.positions_steps()

"""Common behaviour of emulated chains of servos of every make: framing, groups, ids, faults."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from servo_bench import ALL, MAKES, PING, SYNC_READ

from gazerig.sim_mock.replies import merge


@pytest.fixture(params=MAKES, ids=lambda make: make.model)
def make(request):
    return request.param


def bench_of(make, ids=(1,), **options):
    return make(*[(i, make.model, 1000.0 * i) for i in ids], **options)


def pings(bench, servo_id, baud=None):
    """Return whether a ping is answered."""
    return len(bench.chain.receive(bench.instruction(servo_id, PING), baud)) == bench.pong


def answered(bench, *ids):
    """Return the pieces that a group read of the position is answered with."""
    span = bench.span_of("present_position")
    return bench.chain.exchange(bench.instruction(ALL, SYNC_READ, span, *ids))


# --- framing


@pytest.mark.parametrize("noise", [b"\xff", b"\xff\xff\x01", b"\xff\xff\xfd\x00"], ids=repr)
def test_noise_before_an_instruction_is_passed_over(make, noise):
    bench = bench_of(make)
    bench.chain.receive(noise)
    bench.now_s = 0.01
    assert pings(bench, 1)
    assert bench.chain.receive(b"U\x00" + make.instruction(1, PING)) != b""


def test_a_torn_instruction_is_forgotten_after_the_gap(make):
    bench, ping = bench_of(make), make.instruction(1, PING)
    bench.chain.receive(ping[:5])
    bench.now_s = 0.002
    assert bench.chain.receive(ping[5:]) == b""
    assert pings(bench, 1)
    bench.chain.packet_gap_s = 0.05
    for at in range(1, len(ping)):
        bench.chain.receive(ping[:at])
        bench.now_s += 0.04
        assert len(bench.chain.receive(ping[at:])) == make.pong


# --- groups


def test_a_silent_one_silences_those_behind_it(make):
    bench = bench_of(make, (1, 2, 3))
    assert [piece.servo_id for piece in answered(bench, 1, 8, 2, 3)] == [1]


def test_who_sends_at_the_same_time_pulls_the_line_down():
    assert merge(b"\x0f\x01", b"\xf3") == merge(b"\xf3", b"\x0f\x01") == b"\x03\x01"


# --- status


def test_status_tells_everything_as_json(make):
    bench = bench_of(make)
    bench.put("torque_enable", 1)
    bench.put("goal_position", 1100)
    bench.chain.faults.command("lose 1")
    reported = json.loads(bench.chain.faults.command("status"))
    assert reported["faults"] == ["lose 1"]
    assert reported["servos"] == [
        {
            "id": 1, "model": make.model, "position": 1000, "goal": 1100, "torque": 1, "error": 0,
        }
    ]  # fmt: skip
    bench.chain.faults.command("overload 1")
    reported = json.loads(bench.chain.faults.command("status"))
    assert reported["servos"][0]["error"] == 0x20


# --- two clocks, one result


@given(st.sampled_from(MAKES), st.lists(st.floats(0.0005, 0.05), min_size=1, max_size=30))
def test_what_is_answered_does_not_depend_on_how_often_one_looks(make, steps):
    often, seldom = bench_of(make), bench_of(make)
    for bench in (often, seldom):
        bench.put("torque_enable", 1)
        bench.put("goal_position", 2500)
    for step in steps:
        often.now_s += step
        often.position()
    seldom.now_s = often.now_s
    assert often.everything() == seldom.everything()
    assert often.chain.positions_steps() == seldom.chain.positions_steps()

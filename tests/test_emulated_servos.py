"""Common behaviour of emulated servos of every make: answers, kept writes, groups, restarts."""

import pytest
from servo_bench import (
    ACTION,
    ALL,
    FACTORY_RESET,
    MAKES,
    PING,
    READ,
    REBOOT,
    REG_WRITE,
    SYNC_WRITE,
    WRITE,
    DynamixelBench,
    FeetechBench,
)

from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

BAUD = 1_000_000


@pytest.fixture(params=MAKES, ids=lambda make: make.model)
def make(request):
    return request.param


def three(make, **options):
    bench = make(*[(i, make.model, 1000.0 * i) for i in (1, 2, 3)], **options)
    if make is FeetechBench:
        bench.chain.choose_behaviour("reboot", "answer")
    return bench


def ids(said):
    return [servo_id for servo_id, _, _ in said]


def kept_goal(bench, servo_id, goal):
    """Write a goal that waits for Action."""
    raw = bench.registers["goal_position"].encode(goal)
    return bench.ask(servo_id, REG_WRITE, bench.head_of("goal_position"), raw)


# --- who is there


def test_a_ping_to_all_is_answered_in_the_order_of_ids(make):
    bench = make(*[(i, make.model, 0.0) for i in (7, 1, 3)])
    assert ids(bench.ask(ALL, PING)) == [1, 3, 7]


def test_only_a_client_at_the_servos_baud_rate_is_heard(make):
    bench = make(baud=BAUD)
    assert bench.ask(1, PING, baud=115_200) == []
    assert len(bench.ask(1, PING, baud=BAUD)) == 1
    # A new rate counts behind the answer.
    slower = bench.chain.servos[0].baud_rates.index(115_200)
    assert ids(bench.ask(1, WRITE, bench.head_of("baud_rate"), slower, baud=BAUD)) == [1]
    assert [len(bench.ask(1, PING, baud=baud)) for baud in (BAUD, 115_200, 9600)] == [0, 1, 0]
    assert [len(bench.ask(ALL, PING, baud=baud)) for baud in (115_200, BAUD)] == [1, 0]
    assert bench.chain.understands_baud(115_200) and not bench.chain.understands_baud(BAUD)


def test_what_cannot_be_built(make):
    with pytest.raises(ValueError, match=f"baud 1234: {make.model} supports [0-9]+, "):
        make(baud=1234)
    with pytest.raises(ValueError, match="load_nm"):
        make(ServoSpec(1, make.model, 0.0, physics=Physics(load_nm=1e9)))


@pytest.fixture
def bench(make):
    return make()


def test_what_follows_a_new_id_in_the_same_breath_is_heard(bench):
    data = bench.instruction(1, WRITE, bench.head_of("id"), 7) + bench.instruction(7, PING)
    assert ids(bench.packets(bench.chain.receive(data))) == [1, 7]


def test_the_return_delay_stands_in_front_of_the_answer(bench):
    [reply] = bench.chain.exchange(bench.instruction(1, PING))
    assert reply.pieces[0].delay_s == pytest.approx(500e-6)
    assert reply.end == len(bench.instruction(1, PING))
    bench.put("return_delay_time", 10)
    [reply] = bench.chain.exchange(bench.instruction(1, PING))
    assert reply.pieces[0].delay_s == pytest.approx(20e-6)


def test_a_lower_status_return_level_answers_reads_and_pings_only(bench):
    level = bench.get("status_return_level")
    assert bench.put("status_return_level", level - 1) == 0
    assert bench.put("goal_position", 257) == -1
    assert bench.get("goal_position") == 257
    assert len(bench.ask(1, PING)) == 1


# --- writes


def test_a_kept_write_waits_for_action(make):
    bench = three(make)
    before = bench.goals()
    for i in (1, 2):
        assert kept_goal(bench, i, 1024) == [(i, 0, b"")]
    assert [bench.get("registered_instruction", i) for i in (1, 2, 3)] == [1, 1, 0]
    assert bench.goals() == before
    assert bench.ask(ALL, ACTION) == []
    assert bench.goals() == [1024, 1024, before[2]]
    assert bench.get("registered_instruction") == 0


# --- groups


@pytest.mark.parametrize("cut", [1, -1])
def test_a_sync_write_that_does_not_add_up_does_nothing(make, cut):
    bench = three(make)
    before = bench.goals()
    rows = bench.span_of("goal_position") + bytes((1, 1, 1, 2, 1, 1))
    assert bench.ask(ALL, SYNC_WRITE, rows[:cut]) == []
    assert bench.goals() == before


# --- restarts and factory settings


def test_a_reboot_is_confirmed_then_deaf_then_as_at_power_on(make):
    bench = three(make)
    bench.enable_torque(1, 1500)
    bench.put("position_p_gain", 99)
    assert bench.ask(1, REBOOT) == [(1, 0, b"")]
    deaf_s = bench.chain[1].restart_ms / 1000.0
    assert deaf_s == (0.4 if make is DynamixelBench else 0.8)
    bench.wait(deaf_s - 0.01)
    assert bench.ask(1, PING) == []
    bench.wait(0.02)
    assert bench.get("torque_enable") == 0
    assert bench.get("position_p_gain") == bench.get("position_p_gain", 2) != 99


def test_factory_settings_come_back_but_for_the_id_where_that_is_asked(make):
    bench = make((5, make.model, 2048.0), baud=BAUD)
    if make is FeetechBench:
        bench.write(5, 55, 0)
    bench.ask(5, WRITE, bench.head_of("return_delay_time"), 9)
    said = bench.ask(5, FACTORY_RESET, *([1] if make is DynamixelBench else []), baud=BAUD)
    assert said == [(5, 0, b"")]
    bench.wait(1.0)
    [(_, _, delay)] = bench.ask(5, READ, bench.span_of("return_delay_time"),
                                baud=bench.factory_baud)  # fmt: skip
    assert delay == b"\xfa"
    assert bench.chain.faults.command("reset 5").startswith("servo 5 has factory settings: id 1")
    bench.wait(1.0)
    assert ids(bench.ask(1, PING, baud=bench.factory_baud)) == [1]


# --- motion


def test_the_goal_waits_for_the_torque_and_is_followed_then(bench):
    bench.put("goal_position", 2300)
    bench.wait(0.5)
    assert (bench.position(), bench.get("moving")) == (2048, 0)
    bench.put("torque_enable", 1)
    bench.wait(1.0)
    assert bench.position() == pytest.approx(2300, abs=12)


def test_without_torque_a_joint_stays_or_falls_to_its_stop(make):
    load = Physics(load_nm=-0.5, stop_low_steps=700.0)
    stays, sinks = make(), make(ServoSpec(1, make.model, 2048.0, physics=load))
    for bench in (stays, sinks):
        bench.enable_torque()
        bench.wait(1.0)
        bench.put("torque_enable", 0)
        bench.wait(6.0)
    assert (stays.position(), sinks.position()) == (2048, 700)


# --- faults

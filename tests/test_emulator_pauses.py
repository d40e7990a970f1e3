"""Emulators without queries for an hour: the next packet is answered immediately and correctly."""

import pytest
from servo_bench import FeetechBench

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.sim_mock.smart_servo.motor import Shaft
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.protection import ServoProtection

HOUR_S = 3600.0
GOAL, GOAL_SPEED = 42, 46


@pytest.fixture
def lived_ms(monkeypatch):
    """Count the milliseconds that shafts live through, and the checks of protections."""
    count = [0]
    run, check = Shaft.run, ServoProtection.check

    def counted(shaft, ticks):
        count[0] += 0 if shaft.quiet else ticks
        run(shaft, ticks)

    def checked(protection, *words):
        count[0] += 1
        return check(protection, *words)

    monkeypatch.setattr(Shaft, "run", counted)
    monkeypatch.setattr(ServoProtection, "check", checked)
    return count


def moved(bench):
    bench.write(1, 48, 1000, 2)
    bench.enable_torque(1, 3000)
    bench.wait(0.5)


def slow(bench):
    bench.write(1, GOAL_SPEED, 20, 2)  # 40 s and more for what is left
    bench.enable_torque(1, 3000)
    bench.wait(0.5)


def loose(bench):
    moved(bench)
    bench.write(1, 40, 0)


def jammed(bench):
    bench.enable_torque(1, 2048)
    bench.chain.faults.command("stick 1")
    bench.write(1, GOAL, 2100, 2)
    bench.wait(0.5)


STATES = [moved, slow, loose, jammed]


@pytest.mark.parametrize("begin", STATES)
def test_an_hour_costs_no_more_than_seconds(begin, lived_ms):
    bench = FeetechBench(ServoSpec(1, "sts3215", 2048.0))
    begin(bench)
    lived_ms[0] = 0
    bench.now_s += HOUR_S
    bench.position()
    assert lived_ms[0] < 5_000


@pytest.mark.parametrize("begin", STATES)
def test_a_pause_ends_where_a_life_through_it_does(begin):
    ends = []
    for looks in (1, 40):  # of a second each, which is no pause
        bench = FeetechBench(ServoSpec(1, "sts3215", 2048.0))
        begin(bench)
        bench.wait(40.0, looks)
        servo = bench.chain.find_servo(1)
        ends.append((bench.position(), servo.torque, servo.protection.temperature_c))
    (at, torque, warm), (truly, torque_truly, warm_truly) = ends
    apart = abs(at - truly)
    assert min(apart, 4096 - apart) <= 2
    assert torque == torque_truly and warm == pytest.approx(warm_truly, abs=0.5)


@pytest.mark.parametrize("rig", ["desk", "feetech", "maker"])
def test_a_whole_rig_that_nobody_asked_for_an_hour_answers_its_next_question(rig, lived_ms):
    made = assemble(load_rig(rig), RunOptions(mock=True, fast=True, rig=rig, scene="visitor"))
    robot, clock = made.robot, made.clock
    robot.start(clock)
    try:
        for k in range(100):
            clock.sleep_until(0.005 * (k + 1))
            robot.tick(clock.now_s(), 0.005)
        lived_ms[0] = 0
        clock.sleep_until(HOUR_S)
        joints = robot.body.read(clock.now_s())
        assert not joints.missing
        assert lived_ms[0] <= 5_000 * len(made.robot.body.names)
    finally:
        robot.stop()
        made.close()

"""Motion of emulated STS servos: closed forms of the profile, limits, origin, force."""

import pytest
from servo_bench import FeetechBench

from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

SMOOTH = Physics(coulomb_share=0.0, viscous_share=0.0, play_deg=0.0)
STEADY_STEPS = 2
"""Friction keeps a servo with factory gains so far from its goal."""


def one(physics=SMOOTH, start=2048.0):
    return FeetechBench(ServoSpec(1, "sts3215", start, physics=physics))


@pytest.fixture
def bench():
    return one()


# --- limits and origin


@pytest.mark.parametrize(("goal", "at"), [(100, 1000), (4000, 3000), (0x8000 | 50, 1000)])
def test_goals_end_at_the_angle_limits(bench, goal, at):
    bench.write(1, 9, 1000, 2)
    bench.write(1, 11, 3000, 2)
    bench.enable_torque(goal=goal)
    bench.wait(1.5)
    assert bench.position() == pytest.approx(at, abs=STEADY_STEPS)
    assert bench.read(1, 42, 2) == goal


def test_beyond_a_turn_it_counts_on_until_it_restarts():
    bench = one(start=4090.0)
    bench.chain.faults.command("turn 1 278")
    assert bench.position() == 4368
    bench.enable_torque(goal=4000)
    bench.wait(1.5)
    assert bench.position() == pytest.approx(4000, abs=STEADY_STEPS)
    bench.write(1, 40, 0)
    bench.chain.faults.command("turn 1 -4100")
    assert bench.read(1, 56, 2) == 0x8000 | 100
    assert bench.position() == -100
    bench.chain.faults.command("brown-out 1")
    bench.wait(1.0)
    assert bench.position() == 3996

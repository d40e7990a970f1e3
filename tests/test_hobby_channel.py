"""Where a channel's pulse and shaft are taken to be, against closed forms."""

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.hobby_board.channel import Channel, Ramp
from gazerig.drivers.types import ServoConfig

SETUP = ServoConfig(3, "hobby", 4400, 7600, 12_000.0)


def ramp_at(steps):
    ramp = Ramp()
    ramp.begin(steps)
    return ramp


def test_an_acceleration_limit_takes_as_long_as_a_trapezoid():
    ramp = ramp_at(4000.0)
    ramp.speed_steps_s, ramp.accel_steps_s2 = 4000.0, 5000.0
    ticks = 0
    while ramp.pulse_steps < 8000.0:
        ramp.advance(8000.0, 0.01)
        ticks += 1
    # 4000 steps are too short to reach 4000 steps/s: a triangle.
    assert 0.01 * ticks == pytest.approx(2.0 * sqrt(4000.0 / 5000.0), rel=0.05)


@given(
    st.lists(st.tuples(st.floats(2000, 10_000), st.floats(0.0, 0.3)), max_size=30),
    st.integers(0, 300),
    st.integers(0, 255),
)
def test_it_never_leaves_the_range_of_its_goals(moves, speed, accel):
    ramp = ramp_at(6000.0)
    ramp.speed_steps_s, ramp.accel_steps_s2 = 100.0 * speed, 1250.0 * accel
    low = high = 6000.0
    for goal, seconds in moves:
        low, high = min(low, goal), max(high, goal)
        ramp.advance(goal, seconds)
        assert low - 1e-6 <= ramp.pulse_steps <= high + 1e-6


def held(pulse=6000):
    channel = Channel(SETUP)
    channel.adopt_pulse(pulse)
    channel.start(pulse, 0.0)
    channel.ramp.speed_steps_s = SETUP.max_speed_steps_s
    channel.record_hold()
    return channel


def test_a_pulse_must_be_near_the_estimate():
    channel = held()
    assert not channel.is_expected(0) and not channel.is_expected(7300)
    assert channel.is_expected(6010)
    channel.goal_steps = 6600
    for k in range(1, 7):
        channel.advance(0.01 * k)
    assert channel.ramp.pulse_steps == 6600.0
    assert channel.is_expected(6300) and not channel.is_expected(5300)


def test_a_channel_outside_its_limits_moves_in_slowly():
    channel = held()
    assert channel.start(7800, 1.0) == 7600 and channel.entering
    assert channel.top_speed_steps_s == pytest.approx(1333, abs=1)


@pytest.mark.parametrize(("rest", "place"), [(None, 6000), (5000, 5000), (9000, 7600), (0, 4400)])
def test_where_a_servo_without_pulses_is_taken_to_be(rest, place):
    channel = Channel(SETUP._replace(rest_steps=rest))
    assert round(channel.ramp.pulse_steps) == place
    assert channel.start(0, 0.0) == place


def test_new_limits_bring_the_guess_inside_but_leave_a_known_place():
    channel = Channel(SETUP)
    channel.set_target(SETUP._replace(rest_steps=5000))
    assert round(channel.ramp.pulse_steps) == 5000
    channel.adopt_pulse(7000)
    channel.set_target(SETUP._replace(max_steps=6500))
    assert round(channel.ramp.pulse_steps) == 7000
    assert channel.start(7000, 0.0) == 6500 and channel.entering

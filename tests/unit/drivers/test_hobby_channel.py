"""Where a channel's pulse and shaft are taken to be, against closed forms."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.types import ServoConfig

SETUP = ServoConfig(3, "hobby", 4400, 7600, 12_000.0)


@given(st.lists(st.tuples(st.integers(4400, 7600), st.floats(0.0, 0.3)), max_size=30))
def test_a_pulse_keeps_its_speed_and_never_leaves_the_range_of_its_goals(moves):
    channel, now_s = held(), 0.0
    low = high = 6000.0
    for channel.goal_steps, seconds in moves:
        low, high = min(low, channel.goal_steps), max(high, channel.goal_steps)
        before, now_s = channel.pulse_steps, now_s + seconds
        channel.advance(now_s)
        assert low <= channel.pulse_steps <= high
        assert abs(channel.pulse_steps - before) <= 12_000.0 * seconds + 1e-6


def held(pulse=6000):
    channel = Channel(SETUP)
    channel.adopt_pulse(pulse)
    channel.start(pulse, 0.0)
    channel.speed_steps_s = SETUP.max_speed_steps_s
    channel.record_hold()
    return channel


def test_a_pulse_must_be_near_the_estimate():
    channel = held()
    assert not channel.is_expected(0) and not channel.is_expected(7300)
    assert channel.is_expected(6010)
    channel.goal_steps = 6600
    for k in range(1, 7):
        channel.advance(0.01 * k)
    assert channel.pulse_steps == 6600.0
    assert channel.is_expected(6300) and not channel.is_expected(5300)


def test_a_channel_outside_its_limits_moves_in_slowly():
    channel = held()
    assert channel.start(7800, 1.0) == 7600 and channel.entering
    assert channel.top_speed_steps_s == pytest.approx(1333, abs=1)


@pytest.mark.parametrize(("rest", "place"), [(None, 6000), (5000, 5000), (9000, 7600), (0, 4400)])
def test_where_a_servo_without_pulses_is_taken_to_be(rest, place):
    channel = Channel(SETUP._replace(rest_steps=rest))
    assert round(channel.pulse_steps) == place
    assert channel.start(0, 0.0) == place


def test_new_limits_bring_the_guess_inside_but_leave_a_known_place():
    channel = Channel(SETUP)
    channel.set_target(SETUP._replace(rest_steps=5000))
    assert round(channel.pulse_steps) == 5000
    channel.adopt_pulse(7000)
    channel.set_target(SETUP._replace(max_steps=6500))
    assert round(channel.pulse_steps) == 7000
    assert channel.start(7000, 0.0) == 6500 and channel.entering
